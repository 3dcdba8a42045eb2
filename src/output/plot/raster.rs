//! Draws a scene as the pixels of a PNG file.

use super::scene::{Anchor, DASH, Image, Paint, Rgb, Scene, Shape, Text};
use super::text::Font;
use super::{PNG_SCALE, PlotError};
use crate::output::mark;
use skrifa::outline::OutlinePen;
use tiny_skia::{
    Color, FillRule, FilterQuality, LineCap, LineJoin, Path, PathBuilder, Pixmap, PixmapPaint, StrokeDash,
};
use tiny_skia::{PremultipliedColorU8, Transform};

/// Largest height of a picture in pixels: about 100 MB of memory.
const HIGHEST: u32 = 16_000;

/// Draws the scene and encodes it.
///
/// # Errors
/// [`PlotError::Canvas`] if the scene is too high, [`PlotError::Encode`] if the encoder fails.
pub(super) fn render(scene: &Scene, font: &Font) -> Result<Vec<u8>, PlotError> {
    let pixels = |length: f64| (length * f64::from(PNG_SCALE)).round() as u32;
    let (width, height) = (pixels(scene.width), pixels(scene.height));
    let too_large = || PlotError::Canvas { width, height, limit: HIGHEST };
    if height > HIGHEST {
        return Err(too_large());
    }
    let mut pixmap = Pixmap::new(width, height).ok_or_else(too_large)?;
    pixmap.fill(Color::WHITE);
    for shape in scene.groups.iter().flat_map(|group| &group.shapes) {
        draw(&mut pixmap, shape, font);
    }
    let bytes = pixmap.encode_png().map_err(|e| PlotError::Encode { reason: e.to_string() })?;
    Ok(mark::png(&bytes))
}

fn draw(pixmap: &mut Pixmap, shape: &Shape, font: &Font) {
    match shape {
        Shape::Poly { points, closed, paint } => {
            if let Some(path) = join(points, *closed) {
                paint_path(pixmap, &path, paint);
            }
        }
        Shape::Circle { centre, radius, paint } => {
            if let Some(path) = PathBuilder::from_circle(centre.0 as f32, centre.1 as f32, *radius as f32) {
                paint_path(pixmap, &path, paint);
            }
        }
        Shape::Text(text) => draw_text(pixmap, text, font),
        Shape::Image(image) => draw_image(pixmap, image),
    }
}

/// The pixels of an image on their own; `None` if it has none.
pub(super) fn pixmap(image: &Image) -> Option<Pixmap> {
    let mut pixmap = Pixmap::new(u32::try_from(image.width).ok()?, u32::try_from(image.height).ok()?)?;
    for (pixel, &[red, green, blue]) in pixmap.pixels_mut().iter_mut().zip(&image.pixels) {
        *pixel = PremultipliedColorU8::from_rgba(red, green, blue, 255)?;
    }
    Some(pixmap)
}

// Nearest pixels: where the image has the pixels of the picture, they are copied.
fn draw_image(onto: &mut Pixmap, image: &Image) {
    let Some(pixels) = pixmap(image) else { return };
    let scale = f64::from(PNG_SCALE);
    let (across, down) = (image.rect.width() / image.width as f64, image.rect.height() / image.height as f64);
    let place = Transform::from_row(
        (across * scale) as f32,
        0.0,
        0.0,
        (down * scale) as f32,
        (image.rect.x0 * scale) as f32,
        (image.rect.y0 * scale) as f32,
    );
    let paint = PixmapPaint { quality: FilterQuality::Nearest, ..PixmapPaint::default() };
    onto.draw_pixmap(0, 0, pixels.as_ref(), &paint, place, None);
}

fn join(points: &[(f64, f64)], closed: bool) -> Option<Path> {
    let (first, rest) = points.split_first()?;
    let mut path = PathBuilder::new();
    path.move_to(first.0 as f32, first.1 as f32);
    rest.iter().for_each(|p| path.line_to(p.0 as f32, p.1 as f32));
    if closed {
        path.close();
    }
    path.finish()
}

fn paint_path(pixmap: &mut Pixmap, path: &Path, paint: &Paint) {
    let scale = Transform::from_scale(PNG_SCALE as f32, PNG_SCALE as f32);
    if let Some(fill) = paint.fill {
        pixmap.fill_path(path, &solid(fill), FillRule::Winding, scale, None);
    }
    if let Some(stroke) = paint.stroke {
        let dash = stroke.dashed.then(|| StrokeDash::new(DASH.iter().map(|&d| d as f32).collect(), 0.0)).flatten();
        let (line_join, line_cap) = (LineJoin::Round, LineCap::Butt);
        let style = tiny_skia::Stroke { width: stroke.width as f32, dash, line_join, line_cap, ..Default::default() };
        pixmap.stroke_path(path, &solid(stroke.colour), &style, scale, None);
    }
}

fn solid([red, green, blue]: Rgb) -> tiny_skia::Paint<'static> {
    let mut paint = tiny_skia::Paint { anti_alias: true, ..Default::default() };
    paint.set_color_rgba8(red, green, blue, 255);
    paint
}

fn draw_text(pixmap: &mut Pixmap, text: &Text, font: &Font) {
    let width = font.width(&text.label, text.size);
    let mut pen = GlyphPen { path: PathBuilder::new(), x: 0.0, y: 0.0 };
    let mut x = match text.anchor {
        Anchor::Start => 0.0,
        Anchor::Middle => -width / 2.0,
        Anchor::End => -width,
    };
    for run in &text.label.runs {
        let size = text.size * run.level.size();
        for c in run.text.chars() {
            (pen.x, pen.y) = (x as f32, (run.level.shift() * text.size) as f32);
            font.outline(c, size, &mut pen);
            x += font.advance(c, size);
        }
    }
    let Some(path) = pen.path.finish() else { return };
    let scale = PNG_SCALE as f32;
    let mut place = Transform::from_translate(text.at.0 as f32, text.at.1 as f32).post_scale(scale, scale);
    if text.upwards {
        place = place.pre_rotate(-90.0);
    }
    pixmap.fill_path(&path, &solid(text.colour), FillRule::Winding, place, None);
}

// Collects glyph outlines, whose y points upwards, as one path with y downwards.
struct GlyphPen {
    path: PathBuilder,
    x: f32,
    y: f32,
}

impl OutlinePen for GlyphPen {
    fn move_to(&mut self, x: f32, y: f32) {
        self.path.move_to(self.x + x, -self.y - y);
    }

    fn line_to(&mut self, x: f32, y: f32) {
        self.path.line_to(self.x + x, -self.y - y);
    }

    fn quad_to(&mut self, cx0: f32, cy0: f32, x: f32, y: f32) {
        self.path.quad_to(self.x + cx0, -self.y - cy0, self.x + x, -self.y - y);
    }

    fn curve_to(&mut self, cx0: f32, cy0: f32, cx1: f32, cy1: f32, x: f32, y: f32) {
        let (a, b) = ((self.x + cx0, -self.y - cy0), (self.x + cx1, -self.y - cy1));
        self.path.cubic_to(a.0, a.1, b.0, b.1, self.x + x, -self.y - y);
    }

    fn close(&mut self) {
        self.path.close();
    }
}
