//! Parts that the HTML reports share: pages that need nothing beside themselves.

use std::fmt::Write;

/// How every report looks, in light and dark.
const STYLE: &str = "
:root { color-scheme: light dark; --line: #8884; --bad: #c62828; --good: #2e7d32; }
body { font: 15px/1.5 system-ui, sans-serif; margin: 2rem auto; padding: 0 1.5rem; max-width: 110rem; }
h1 { margin-bottom: 0; } h2 { margin-top: 2.5rem; border-top: 1px solid var(--line); padding-top: 1rem; }
table { border-collapse: collapse; margin: 1rem 0; font-variant-numeric: tabular-nums; }
th, td { padding: .2rem .8rem .2rem 0; text-align: left; border-bottom: 1px solid var(--line); vertical-align: top; }
td.number, th.number { text-align: right; } .ok { color: var(--good); } .bad { color: var(--bad); font-weight: 600; }
.row { display: flex; flex-wrap: wrap; gap: 1rem; } figure { margin: 0; } figcaption { font-size: 13px; }
img { display: block; width: 256px; image-rendering: pixelated; background: #000; }
img.wide { width: 320px; image-rendering: auto; } .note { opacity: .75; margin: .2rem 0; }
";

/// A page's first lines, up to its heading.
#[must_use]
pub fn page_start(title: &str) -> String {
    let mut html = String::new();
    push(
        &mut html,
        format_args!(
            "<!doctype html><html lang=\"en\"><meta charset=\"utf-8\"><title>{title}</title><style>{STYLE}</style>"
        ),
    );
    push(&mut html, format_args!("<h1>cargo xtask {title}</h1>"));
    html
}

/// A figure with the digits that count; a dash where there is none.
#[must_use]
pub fn number(value: Option<f64>) -> String {
    match value {
        None => "–".into(),
        Some(0.0) => "0".into(),
        Some(v) if v.abs() < 1e-3 => format!("{v:.1e}"),
        Some(v) => format!("{v:.4}"),
    }
}

/// Text as HTML.
#[must_use]
pub fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// A line.
pub fn push(html: &mut String, text: std::fmt::Arguments<'_>) {
    html.write_fmt(text).expect("a String takes all text");
    html.push('\n');
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_cannot_become_markup() {
        assert_eq!(escaped("<b a=\"1\"> & c"), "&lt;b a=&quot;1&quot;&gt; &amp; c");
    }

    #[test]
    fn numbers_keep_their_digits() {
        let shown = [0.0, 1.25e-5, 0.5, 1.00002].map(|v| number(Some(v)));
        assert_eq!(shown, ["0", "1.3e-5", "0.5000", "1.0000"]);
        assert_eq!(number(None), "–");
    }
}
