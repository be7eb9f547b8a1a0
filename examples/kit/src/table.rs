//! Tables for a terminal.

/// Lines of cells under a head, the first column flush left, the others flush right.
pub fn table(head: &[String], rows: &[Vec<String>]) -> String {
    let width = |column: usize| rows.iter().chain([&head.to_vec()]).map(|row| length(&row[column])).max().unwrap_or(0);
    let widths: Vec<usize> = (0..head.len()).map(width).collect();
    let rule = "-".repeat(widths.iter().sum::<usize>() + 2 * (widths.len() - 1));
    let body = rows.iter().map(|row| line(row, &widths));
    [line(head, &widths), rule].into_iter().chain(body).map(|line| line + "\n").collect()
}

fn line(cells: &[String], widths: &[usize]) -> String {
    let padded = cells.iter().zip(widths).enumerate().map(|(column, (cell, width))| {
        let gap = " ".repeat(width - length(cell));
        if column == 0 { format!("{cell}{gap}") } else { format!("  {gap}{cell}") }
    });
    padded.collect::<String>().trim_end().to_owned()
}

fn length(text: &str) -> usize {
    text.chars().count()
}

#[cfg(test)]
mod tests {
    use super::table;

    #[test]
    fn columns_line_up() {
        let text = |cells: &[&str]| cells.iter().map(|cell| (*cell).to_owned()).collect::<Vec<_>>();
        let drawn = table(&text(&["run", "steps"]), &[text(&["nominal", "1200"]), text(&["±", "7"])]);
        assert_eq!(drawn, "run      steps\n--------------\nnominal   1200\n±            7\n");
    }
}
