//! The only module that writes SVG: a page, and the elements of the pictures of traces and timings.
//!
//! Positions are in units of the page, right and down. A `style` is a list of SVG attributes.

use std::fmt::Write as _;

/// A picture that grows element by element.
pub(crate) struct Svg(String);

impl Svg {
    /// A white page; letters are `font` units high unless a style says otherwise.
    pub(crate) fn new(width: f64, height: f64, font: u32) -> Self {
        let mut page = Self(String::new());
        page.line(format_args!(
            r##"<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" height="{height}" font-family="sans-serif" font-size="{font}" fill="#222">"##
        ));
        page.line(format_args!(
            r##"<rect width="100%" height="100%" fill="#fff"/>"##
        ));
        page
    }

    /// Everything drawn until [`Svg::end_group`] is moved down by `top`.
    pub(crate) fn begin_group(&mut self, top: f64) {
        self.line(format_args!(r#"<g transform="translate(0 {top:.1})">"#));
    }

    /// Ends the group of [`Svg::begin_group`].
    pub(crate) fn end_group(&mut self) {
        self.line(format_args!("</g>"));
    }

    /// Text that begins at `x`, or ends or is centred there if the style has another `text-anchor`.
    pub(crate) fn text(&mut self, x: f64, y: f64, style: &str, content: &str) {
        let content = escape(content);
        self.line(format_args!(
            r#"<text x="{x:.1}" y="{y:.1}" {style}>{content}</text>"#
        ));
    }

    /// A rectangle by its upper left corner, width and height.
    pub(crate) fn rectangle(&mut self, [x, y, width, height]: [f64; 4], style: &str) {
        self.line(format_args!(
            r#"<rect x="{x:.1}" y="{y:.1}" width="{width:.1}" height="{height:.1}" {style}/>"#
        ));
    }

    /// The same with a name shown as a tooltip.
    pub(crate) fn named_rectangle(
        &mut self,
        [x, y, width, height]: [f64; 4],
        style: &str,
        name: &str,
    ) {
        let name = escape(name);
        self.line(format_args!(
            r#"<rect x="{x:.1}" y="{y:.1}" width="{width:.1}" height="{height:.1}" {style}><title>{name}</title></rect>"#
        ));
    }

    /// A horizontal line.
    pub(crate) fn across(&mut self, from: f64, to: f64, y: f64, style: &str) {
        self.path(&format!("M{from:.1} {y:.1}H{to:.1}"), style);
    }

    /// A vertical line.
    pub(crate) fn down(&mut self, x: f64, from: f64, to: f64, style: &str) {
        self.path(&format!("M{x:.1} {from:.1}V{to:.1}"), style);
    }

    /// A vertical line with a name shown as a tooltip.
    pub(crate) fn named_down(&mut self, x: f64, from: f64, to: f64, style: &str, name: &str) {
        let name = escape(name);
        self.line(format_args!(
            r#"<path d="M{x:.1} {from:.1}V{to:.1}" {style}><title>{name}</title></path>"#
        ));
    }

    /// Lines by SVG's path commands.
    pub(crate) fn path(&mut self, commands: &str, style: &str) {
        self.line(format_args!(r#"<path d="{commands}" {style}/>"#));
    }

    /// A line through points, `x,y` separated by blanks.
    pub(crate) fn polyline(&mut self, points: &str, style: &str) {
        self.line(format_args!(
            r#"<polyline points="{points}" fill="none" {style}/>"#
        ));
    }

    /// The document.
    pub(crate) fn finish(mut self) -> String {
        self.line(format_args!("</svg>"));
        self.0
    }

    fn line(&mut self, element: std::fmt::Arguments<'_>) {
        // Writing to a string cannot fail.
        let _ = writeln!(self.0, "{element}");
    }
}

/// A round value on an axis.
pub(crate) struct Tick {
    pub(crate) value: f64,
    pub(crate) label: String,
}

/// Round values between two bounds, about `count` of them: steps of 1, 2 or 5 times a power of ten.
pub(crate) fn ticks(low: f64, high: f64, count: u32) -> Vec<Tick> {
    let rough = (high - low) / f64::from(count);
    let power = libm::pow(10.0, libm::log10(rough).floor());
    let step = [1.0, 2.0, 5.0, 10.0]
        .map(|factor| factor * power)
        .into_iter()
        .find(|step| *step >= rough)
        .unwrap_or(10.0 * power);
    let decimals = (-libm::log10(step).floor()).max(0.0) as usize;
    let first = (low / step).ceil() as i64;
    let last = (high / step).floor() as i64;
    (first..=last)
        .map(|number| {
            let value = number as f64 * step;
            Tick {
                value,
                label: format!("{value:.decimals$}"),
            }
        })
        .collect()
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
}

/// Elements of a document in their order, each as name and attributes; panics if tags are not closed as in XML.
#[cfg(test)]
pub(crate) fn elements(svg: &str) -> Vec<(String, std::collections::BTreeMap<String, f64>)> {
    let mut open = Vec::new();
    let mut elements = Vec::new();
    for tag in svg.split('<').skip(1) {
        let (tag, text) = tag.split_once('>').expect("a tag ends");
        assert!(!text.contains('>'), "a bare > in {text}");
        if let Some(name) = tag.strip_prefix('/') {
            assert_eq!(open.pop().as_deref(), Some(name));
            continue;
        }
        let closed = tag.ends_with('/');
        let (name, attributes) = tag.split_once(' ').unwrap_or((tag, ""));
        let mut parts = attributes.split('"');
        let mut numbers = std::collections::BTreeMap::new();
        while let (Some(key), Some(value)) = (parts.next(), parts.next()) {
            if let Ok(number) = value.parse::<f64>() {
                assert!(number.is_finite(), "{tag}");
                numbers.insert(key.trim().trim_end_matches('=').to_owned(), number);
            }
        }
        if !closed {
            open.push(name.to_owned());
        }
        elements.push((name.to_owned(), numbers));
    }
    assert!(open.is_empty(), "never closed: {open:?}");
    elements
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_is_well_formed_whatever_is_written_on_it() {
        let mut page = Svg::new(10.0, 5.0, 12);
        page.text(1.0, 2.0, r#"fill="red""#, "<a> & b");
        page.named_rectangle([0.0, 0.0, 1.0, 2.25], "", "<b>");
        let svg = page.finish();
        let names: Vec<_> = elements(&svg).into_iter().map(|(name, _)| name).collect();
        assert_eq!(names, ["svg", "rect", "text", "rect", "title"]);
        assert!(svg.contains("&lt;a&gt; &amp; b"));
        let unclosed = std::panic::catch_unwind(|| elements("<svg><rect></svg>"));
        assert!(unclosed.is_err());
    }

    #[test]
    fn ticks_are_round() {
        let labels = |low, high| -> Vec<String> {
            ticks(low, high, 5)
                .into_iter()
                .map(|tick| tick.label)
                .collect()
        };
        assert_eq!(labels(-0.3, 1.0), ["0.0", "0.5", "1.0"]);
        assert_eq!(labels(3.0, 47.0), ["10", "20", "30", "40"]);
    }
}
