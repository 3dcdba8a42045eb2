//! Writes a scene as SVG.

use super::raster;
use super::scene::{Anchor, DASH, Group, Image, Paint, Rgb, Scene, Shape, Text};
use super::text::Level;
use base64::Engine;
use base64::engine::general_purpose::STANDARD as BASE64;
use std::fmt::Write;

// DejaVu Sans is wide, so every other family takes less room than was reserved.
const FAMILIES: &str = "DejaVu Sans, Verdana, Noto Sans, Liberation Sans, Arial, Helvetica, sans-serif";

/// Writes the scene as an SVG document.
pub(super) fn render(scene: &Scene) -> String {
    let (width, height) = (number(scene.width), number(scene.height));
    let mut out = format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" \
         height=\"{height}\" viewBox=\"0 0 {width} {height}\" font-family=\"{FAMILIES}\" stroke-linejoin=\"round\">\n"
    );
    out.push_str(&format!("<!-- {} -->\n", crate::names::MADE_BY));
    out.push_str(&format!("<title>{}</title>\n", escape(&scene.title)));
    out.push_str("<rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>\n");
    scene.groups.iter().for_each(|group| push_group(&mut out, group));
    out.push_str("</svg>\n");
    out
}

fn push_group(out: &mut String, group: &Group) {
    out.push_str("<g>\n");
    if let Some(name) = &group.name {
        out.push_str(&format!("<title>{}</title>\n", escape(name)));
    }
    for shape in &group.shapes {
        match shape {
            Shape::Poly { points, closed, paint } => {
                let element = if *closed { "polygon" } else { "polyline" };
                let list: Vec<String> = points.iter().map(|p| format!("{},{}", number(p.0), number(p.1))).collect();
                out.push_str(&format!("<{element} points=\"{}\"{}/>\n", list.join(" "), paint_attributes(paint)));
            }
            Shape::Circle { centre, radius, paint } => {
                let (x, y, r) = (number(centre.0), number(centre.1), number(*radius));
                out.push_str(&format!("<circle cx=\"{x}\" cy=\"{y}\" r=\"{r}\"{}/>\n", paint_attributes(paint)));
            }
            Shape::Text(text) => push_text(out, text),
            Shape::Image(image) => push_image(out, image),
        }
    }
    out.push_str("</g>\n");
}

fn push_text(out: &mut String, text: &Text) {
    let (x, y) = (number(text.at.0), number(text.at.1));
    let mut attributes =
        format!("x=\"{x}\" y=\"{y}\" font-size=\"{}\" fill=\"{}\"", number(text.size), hex(text.colour));
    attributes.push_str(match text.anchor {
        Anchor::Start => "",
        Anchor::Middle => " text-anchor=\"middle\"",
        Anchor::End => " text-anchor=\"end\"",
    });
    if text.upwards {
        attributes.push_str(&format!(" transform=\"rotate(-90 {x} {y})\""));
    }
    if text.label.runs.iter().any(|run| run.level != Level::Base) {
        attributes.push_str(&format!(" aria-label=\"{}\"", escape(&text.label.source)));
    }
    out.push_str(&format!("<text {attributes} xml:space=\"preserve\">{}</text>\n", spans(text)));
}

// `xlink:href` rather than `href`: older readers know no other.
fn push_image(out: &mut String, image: &Image) {
    let (x, y) = (number(image.rect.x0), number(image.rect.y0));
    let (width, height) = (number(image.rect.width()), number(image.rect.height()));
    // Pixels that no PNG can hold leave a gap in the picture; the drawing of the PNG reports them.
    let Some(Ok(png)) = raster::pixmap(image).map(|pixmap| pixmap.encode_png()) else { return };
    out.push_str(&format!(
        "<image xmlns:xlink=\"http://www.w3.org/1999/xlink\" x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\" \
         preserveAspectRatio=\"none\" xlink:href=\"data:image/png;base64,{}\"/>\n",
        BASE64.encode(png)
    ));
}

// Scripts as smaller spans; each shift is relative to the span before.
fn spans(text: &Text) -> String {
    let mut out = String::new();
    let mut raised = 0.0;
    for run in &text.label.runs {
        let shift = run.level.shift() * text.size;
        if run.level == Level::Base && raised == 0.0 {
            out.push_str(&escape(&run.text));
        } else {
            let size = number(run.level.size() * text.size);
            let down = number(raised - shift);
            // Writing to a String cannot fail.
            write!(out, "<tspan dy=\"{down}\" font-size=\"{size}\">{}</tspan>", escape(&run.text)).ok();
        }
        raised = shift;
    }
    out
}

fn paint_attributes(paint: &Paint) -> String {
    let mut out = format!(" fill=\"{}\"", paint.fill.map_or("none".to_owned(), hex));
    if let Some(stroke) = paint.stroke {
        out.push_str(&format!(" stroke=\"{}\" stroke-width=\"{}\"", hex(stroke.colour), number(stroke.width)));
        if stroke.dashed {
            out.push_str(&format!(" stroke-dasharray=\"{} {}\"", number(DASH[0]), number(DASH[1])));
        }
    }
    out
}

fn hex([red, green, blue]: Rgb) -> String {
    format!("#{red:02x}{green:02x}{blue:02x}")
}

// Hundredths of a unit without trailing zeros.
fn number(value: f64) -> String {
    let text = format!("{value:.2}");
    let short = text.trim_end_matches('0').trim_end_matches('.');
    if short == "-0" { "0".to_owned() } else { short.to_owned() }
}

// XML 1.0 forbids most control characters, even escaped ones.
fn escape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\t' | '\n' | '\r' => out.push(' '),
            '\u{0}'..='\u{1f}' | '\u{fffe}' | '\u{ffff}' => out.push('\u{fffd}'),
            _ => out.push(c),
        }
    }
    out
}
