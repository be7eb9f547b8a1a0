//! Writes the generated files of `docs`: `cargo run --release -p dpc-tests --bin manual`.

use dpc_tests::manual::{pages, repository};

fn main() -> std::io::Result<()> {
    for page in pages::pages() {
        std::fs::write(repository().join(page.path), page.text)?;
        println!("{}", page.path);
    }
    Ok(())
}
