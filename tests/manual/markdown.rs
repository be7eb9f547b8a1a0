//! What the pages of the manual are made of: blocks of code, links, headings.

use pulldown_cmark::{CodeBlockKind, Event, LinkType, Options, Parser, Tag, TagEnd};

/// A page, as far as it can be checked.
#[derive(Debug, Default)]
pub struct Markdown {
    pub blocks: Vec<Block>,
    /// Where links and pictures lead.
    pub links: Vec<String>,
    /// What links may name behind `#`.
    pub anchors: Vec<String>,
    pub comments: Vec<String>,
}

/// A block of code.
#[derive(Debug, Clone, Default)]
pub struct Block {
    /// The first word behind the fence.
    pub language: String,
    /// The others.
    pub words: Vec<String>,
    pub text: String,
    /// Counted from 1: where its text starts.
    pub line: usize,
}

impl Block {
    pub fn is(&self, language: &str, word: &str) -> bool {
        self.language == language && self.words.iter().any(|found| found == word)
    }

    /// `NAME` of a word `file=NAME`.
    pub fn file(&self) -> Option<&str> {
        self.words.iter().find_map(|word| word.strip_prefix("file="))
    }
}

impl Markdown {
    pub fn new(text: &str) -> Self {
        let mut page = Self::default();
        let mut heading = None;
        let mut block = None;
        for (event, place) in Parser::new_ext(text, Options::ENABLE_TABLES).into_offset_iter() {
            match event {
                Event::Start(Tag::CodeBlock(kind)) => block = Some(fenced(&kind)),
                Event::End(TagEnd::CodeBlock) => page.blocks.extend(block.take()),
                Event::Start(Tag::Heading { .. }) => heading = Some(String::new()),
                Event::End(TagEnd::Heading(_)) => page.anchor(&heading.take().unwrap_or_default()),
                Event::Start(Tag::Link { link_type, dest_url, .. }) if link_type != LinkType::Autolink => {
                    page.links.push(dest_url.to_string());
                }
                Event::Start(Tag::Image { dest_url, .. }) => page.links.push(dest_url.to_string()),
                Event::Html(html) => page.comments.push(html.trim().to_owned()),
                Event::Text(words) | Event::Code(words) => match (&mut block, &mut heading) {
                    (Some(block), _) => block.push(&words, line(text, place.start)),
                    (None, Some(heading)) => heading.push_str(&words),
                    (None, None) => {}
                },
                _ => {}
            }
        }
        page
    }

    /// A heading's anchor, as the usual sites make it.
    fn anchor(&mut self, heading: &str) {
        let kept =
            heading.to_lowercase().chars().filter(|c| c.is_alphanumeric() || " -_".contains(*c)).collect::<String>();
        let slug = kept.replace(' ', "-");
        let before = self.anchors.iter().filter(|anchor| **anchor == slug).count();
        self.anchors.push(if before == 0 { slug } else { format!("{slug}-{before}") });
    }
}

impl Block {
    fn push(&mut self, text: &str, line: usize) {
        if self.text.is_empty() {
            self.line = line;
        }
        self.text.push_str(text);
    }
}

fn fenced(kind: &CodeBlockKind<'_>) -> Block {
    let words = match kind {
        CodeBlockKind::Fenced(words) => words.to_string(),
        CodeBlockKind::Indented => String::new(),
    };
    let mut words = words.split_whitespace().map(str::to_owned);
    Block { language: words.next().unwrap_or_default(), words: words.collect(), ..Block::default() }
}

fn line(text: &str, place: usize) -> usize {
    1 + text[..place].matches('\n').count()
}
