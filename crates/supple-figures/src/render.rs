//! Files of figures: SVG with outlined texts, PDF with an embedded font, PNG for print.

use std::sync::Arc;

use krilla::Document;
use krilla::geom::Size;
use krilla::metadata::Metadata;
use krilla::page::PageSettings;
use krilla_svg::{SurfaceExt, SvgSettings};
use resvg::tiny_skia::{Pixmap, Transform};
use resvg::usvg::{Options, Tree, WriteOptions, fontdb};

use crate::FigureError;
use crate::draw::{self, FAMILY, Page};
use crate::figure::Figure;

/// Points of a millimetre.
const POINTS: f64 = 72.0 / 25.4;
/// Pixels of a millimetre, for 600 dots per inch.
const PIXELS: f64 = 600.0 / 25.4;

/// The format of a file.
///
/// Example: the [front page](crate).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Format {
    /// Vector graphics for pages; texts are outlines, so that they look the same everywhere.
    Svg,
    /// Pixels, 600 per inch.
    Png,
    /// Vector graphics for papers; texts can be searched, and their font is embedded.
    Pdf,
}

impl Format {
    /// How names of such files end.
    #[must_use]
    pub fn extension(self) -> &'static str {
        match self {
            Self::Svg => "svg",
            Self::Png => "png",
            Self::Pdf => "pdf",
        }
    }
}

/// The width of a figure.
///
/// Example: the [front page](crate).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Width {
    /// One column of a paper of two, 88 mm.
    Column,
    /// Both columns, 180 mm.
    Page,
}

impl Width {
    /// In millimetres.
    #[must_use]
    pub fn millimetres(self) -> f64 {
        match self {
            Self::Column => 88.0,
            Self::Page => 180.0,
        }
    }
}

/// The file of a figure.
///
/// # Errors
/// Where it cannot be made, as where it is too large for its format.
///
/// Example: the [front page](crate).
pub fn render(figure: &Figure, format: Format, width: Width) -> Result<Vec<u8>, FigureError> {
    let failed =
        |message: String| FigureError::Render { figure: figure.name.clone(), format: format.extension(), message };
    let grid = match width {
        Width::Column => figure.column,
        Width::Page => figure.page,
    };
    let page = draw::page(figure, grid, width.millimetres() * POINTS);
    let tree = Tree::from_str(&page.svg, &options()).map_err(|error| failed(error.to_string()))?;
    match format {
        Format::Svg => Ok(svg(figure, &page, &tree)),
        Format::Png => png(&page, &tree, width).map_err(failed),
        Format::Pdf => pdf(figure, &page, &tree).map_err(failed),
    }
}

/// With the font that comes with the program, and none of the system.
fn options() -> Options<'static> {
    let mut fonts = fontdb::Database::new();
    fonts.load_font_data(notosans::REGULAR_TTF.to_vec());
    Options { font_family: FAMILY.to_owned(), fontdb: Arc::new(fonts), ..Options::default() }
}

fn svg(figure: &Figure, page: &Page, tree: &Tree) -> Vec<u8> {
    let options = WriteOptions { coordinates_precision: 3, transforms_precision: 4, ..WriteOptions::default() };
    let text = tree.to_string(&options);
    // The size in print, which the writer gives in pixels, and words for those who cannot see the figure.
    let body = text.find('>').and_then(|end| text.get(end + 1..)).unwrap_or_default();
    let [width, height] = [page.width, page.height];
    let [wide, high] = [width, height].map(|length| length / POINTS);
    let (name, title) = (draw::escaped(&figure.name), draw::escaped(&figure.title));
    let head = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{wide:.3}mm\" height=\"{high:.3}mm\" \
         viewBox=\"0 0 {width:.3} {height:.3}\" role=\"img\" aria-label=\"{name}\">\n    <title>{title}</title>"
    );
    (head + body).into_bytes()
}

fn png(page: &Page, tree: &Tree, width: Width) -> Result<Vec<u8>, String> {
    let columns = (width.millimetres() * PIXELS).round();
    let scale = columns / page.width;
    let rows = (page.height * scale).ceil();
    let too_large = || format!("an image of {columns} x {rows} pixels is too large");
    let mut pixels = Pixmap::new(columns as u32, rows as u32).ok_or_else(too_large)?;
    // The last row of pixels may reach below the page.
    pixels.fill(resvg::tiny_skia::Color::WHITE);
    resvg::render(tree, Transform::from_scale(scale as f32, scale as f32), &mut pixels.as_mut());
    let colours: Vec<u8> =
        pixels.pixels().iter().flat_map(|pixel| [pixel.red(), pixel.green(), pixel.blue()]).collect();
    let mut out = Vec::new();
    let mut encoder = png::Encoder::new(&mut out, pixels.width(), pixels.height());
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    let per_metre = (PIXELS * 1000.0).round() as u32;
    let dimensions = png::PixelDimensions { xppu: per_metre, yppu: per_metre, unit: png::Unit::Meter };
    encoder.set_pixel_dims(Some(dimensions));
    let mut writer = encoder.write_header().map_err(|error| error.to_string())?;
    writer.write_image_data(&colours).map_err(|error| error.to_string())?;
    writer.finish().map_err(|error| error.to_string())?;
    Ok(out)
}

fn pdf(figure: &Figure, page: &Page, tree: &Tree) -> Result<Vec<u8>, String> {
    let (width, height) = (page.width as f32, page.height as f32);
    let size =
        Size::from_wh(width, height).ok_or_else(|| format!("{width} x {height} points is not a valid page size"))?;
    let mut document = Document::new();
    document.set_metadata(Metadata::new().title(figure.title.clone()).creator("supple".to_owned()));
    let mut sheet = document.start_page_with(PageSettings::new(size));
    let mut surface = sheet.surface();
    surface.draw_svg(tree, size, SvgSettings::default()).ok_or("the drawing is empty")?;
    surface.finish();
    sheet.finish();
    document.finish().map_err(|error| format!("{error:?}"))
}
