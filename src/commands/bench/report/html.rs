//! One page that needs nothing else: plots are in it, light and dark follow the reader's system.

use std::fmt::Write as _;

use super::{Block, Head, Image, Section, Table, tally};

/// Plots are black on white; in the dark their paper, ink and white areas are turned, their colours are kept.
const STYLE: &str = "
:root { color-scheme: light dark; --paper: #ffffff; --ink: #1c1c1c; --faint: #666; --line: #d8d8d8; --mark: #b04a00; }
@media (prefers-color-scheme: dark) {
  :root { --paper: #16181c; --ink: #e4e4e4; --faint: #a0a0a0; --line: #3a3d44; --mark: #ff9d57; }
  svg rect[fill=\"#FFFFFF\"] { fill: var(--paper); }
  svg rect[fill=\"#000000\"] { fill: var(--ink); }
  svg text[fill=\"#000000\"] { fill: var(--ink); }
  svg [stroke=\"#000000\"] { stroke: var(--ink); }
}
body { margin: 0 auto; max-width: 1180px; padding: 1.5rem; background: var(--paper); color: var(--ink);
  font: 16px/1.5 system-ui, sans-serif; }
h1 { font-size: 1.7rem; } h2 { margin-top: 2.5rem; border-bottom: 1px solid var(--line); }
nav a { margin-right: 1rem; } a { color: inherit; }
dl { display: grid; grid-template-columns: max-content 1fr; gap: .15rem 1rem; } dt { color: var(--faint); } dd { margin: 0; }
figure { margin: 1.5rem 0; overflow-x: auto; } figcaption, caption { color: var(--faint); text-align: left; padding: .3rem 0; }
svg, img { max-width: 100%; height: auto; }
details { margin: 1rem 0; } summary { cursor: pointer; }
.wide { overflow-x: auto; } table { border-collapse: collapse; font-variant-numeric: tabular-nums; font-size: .9rem; }
th, td { padding: .2rem .6rem; border-bottom: 1px solid var(--line); text-align: right; white-space: nowrap; }
th { white-space: normal; vertical-align: bottom; } th:first-child, td:first-child { text-align: left; } td.noisy { color: var(--mark); }
";

/// All of a report.
pub(super) fn report(head: &Head, sections: &[Section]) -> String {
    let title = escaped(&head.title);
    let mut page = format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>{title}</title>\n\
         <style>{STYLE}</style>\n</head>\n<body>\n<h1>{title}</h1>\n<dl>\n"
    );
    for (name, value) in &head.facts {
        push(&mut page, format_args!("<dt>{}</dt><dd>{}</dd>\n", escaped(name), escaped(value)));
    }
    page.push_str("</dl>\n<nav>");
    for section in sections {
        push(&mut page, format_args!("<a href=\"#{0}\">{0}</a>", section.id));
    }
    page.push_str("</nav>\n");
    for part in sections {
        push(&mut page, format_args!("<section id=\"{}\">\n", part.id));
        push(&mut page, format_args!("<h2>{}</h2>\n", escaped(&part.title)));
        part.blocks.iter().for_each(|block| self::block(&mut page, block));
        let [all, noisy] = tally(&part.figures);
        if all > 0 {
            let said =
                format!("{all} ratios, {noisy} of them noisy (~): quartiles more than 10 % apart.");
            push(&mut page, format_args!("<p>{said}</p>\n"));
        }
        page.push_str("</section>\n");
    }
    page.push_str("</body>\n</html>\n");
    page
}

fn push(page: &mut String, what: std::fmt::Arguments<'_>) {
    page.write_fmt(what).expect("strings grow");
}

fn block(page: &mut String, block: &Block) {
    match block {
        Block::Text(words) => push(page, format_args!("<p>{}</p>\n", escaped(words))),
        Block::Table(rows) => table(page, rows),
        Block::Plot(plot) => {
            let caption = escaped(&plot.caption);
            page.push_str("<figure>\n");
            match &plot.image {
                Image::Svg(text) => page.push_str(&inlined(text, &caption)),
                Image::Png(bytes) => push(
                    page,
                    format_args!(
                        "<img alt=\"{caption}\" src=\"data:image/png;base64,{}\">",
                        base64(bytes)
                    ),
                ),
            }
            push(page, format_args!("\n<figcaption>{caption}</figcaption>\n</figure>\n"));
        }
    }
}

/// An SVG file as part of a page: without what only files have, and able to shrink.
fn inlined(text: &str, caption: &str) -> String {
    let start = text.find("<svg").unwrap_or(0);
    let label = format!("<svg role=\"img\" aria-label=\"{caption}\" ");
    text[start..].replacen("<svg ", &label, 1).replace(" xmlns=\"http://www.w3.org/2000/svg\"", "")
}

/// A table with more rows is folded up.
const LONG: usize = 26;

fn table(page: &mut String, table: &Table) {
    let long = table.rows.len() > LONG;
    if long {
        let caption = escaped(&table.caption);
        push(
            page,
            format_args!("<details><summary>{caption}: {} rows</summary>\n", table.rows.len()),
        );
    }
    page.push_str("<div class=\"wide\"><table>\n");
    if !table.caption.is_empty() && !long {
        push(page, format_args!("<caption>{}</caption>\n", escaped(&table.caption)));
    }
    page.push_str("<thead><tr>");
    table.head.iter().for_each(|cell| push(page, format_args!("<th>{}</th>", escaped(cell))));
    page.push_str("</tr></thead>\n<tbody>\n");
    for row in &table.rows {
        page.push_str("<tr>");
        for cell in row {
            let class = if cell.ends_with('~') { " class=\"noisy\"" } else { "" };
            push(page, format_args!("<td{class}>{}</td>", escaped(cell)));
        }
        page.push_str("</tr>\n");
    }
    page.push_str("</tbody>\n</table></div>\n");
    if long {
        page.push_str("</details>\n");
    }
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// RFC 4648, section 4.
fn base64(bytes: &[u8]) -> String {
    const LETTERS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for group in bytes.chunks(3) {
        let at = |i: usize| u32::from(group.get(i).copied().unwrap_or(0));
        let bits = at(0) << 16 | at(1) << 8 | at(2);
        for k in 0..4 {
            let letter = LETTERS[(bits >> (18 - 6 * k) & 63) as usize];
            text.push(if k <= group.len() { char::from(letter) } else { '=' });
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_is_that_of_the_rfc() {
        for (bytes, text) in
            [("", ""), ("f", "Zg=="), ("fo", "Zm8="), ("foo", "Zm9v"), ("foobar", "Zm9vYmFy")]
        {
            assert_eq!(base64(bytes.as_bytes()), text);
        }
    }
}
