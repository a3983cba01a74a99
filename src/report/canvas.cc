#include "report/canvas.h"

#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <numbers>
#include <string_view>
#include <system_error>

#include <cairo-pdf.h>
#include <cairo-svg.h>
#include <cairo.h>
#include <fmt/format.h>
#include <fontconfig/fontconfig.h>

#include "base/errors.h"
#include "base/paths.h"

namespace assay {
namespace {

cairo_status_t append(void* closure, const unsigned char* data, unsigned int length) {
  // cairo writes bytes through a pointer without a type
  static_cast<std::string*>(closure)->append(reinterpret_cast<const char*>(data), length);
  return CAIRO_STATUS_SUCCESS;
}

cairo_surface_t* make_surface(Format format, std::string& bytes, double width, double height) {
  if (format == Format::kSvg) {
    cairo_surface_t* surface = cairo_svg_surface_create_for_stream(append, &bytes, width, height);
    cairo_svg_surface_set_document_unit(surface, CAIRO_SVG_UNIT_PT);
    return surface;
  }
  cairo_surface_t* surface = cairo_pdf_surface_create_for_stream(append, &bytes, width, height);
  // Equal results give equal bytes: without the time of the drawing.
  cairo_pdf_surface_set_metadata(surface, CAIRO_PDF_METADATA_CREATE_DATE, "2000-01-01T00:00:00Z");
  cairo_pdf_surface_set_metadata(surface, CAIRO_PDF_METADATA_CREATOR, "assay");
  return surface;
}

// Corners of a mark of unit area or so, around the origin.
std::vector<Canvas::Point> corners(Mark mark) {
  std::vector<Canvas::Point> points;
  const auto polygon = [&](int count, double radius, double turn, double inner) {
    points.reserve(static_cast<size_t>(count));
    for (int i = 0; i < count; ++i) {
      const double angle = turn + 2 * std::numbers::pi * i / count;
      const double r = i % 2 == 0 ? radius : inner;
      points.push_back({r * std::sin(angle), -r * std::cos(angle)});
    }
  };
  switch (mark) {
    case Mark::kSquare:
      polygon(4, 0.7, std::numbers::pi / 4, 0.7);
      break;
    case Mark::kTriangle:
      polygon(3, 0.8, 0, 0.8);
      break;
    case Mark::kTriangleDown:
      polygon(3, 0.8, std::numbers::pi, 0.8);
      break;
    case Mark::kDiamond:
      points = {{0, -0.85}, {0.55, 0}, {0, 0.85}, {-0.55, 0}};
      break;
    case Mark::kStar:
      polygon(10, 1.05, 0, 0.45);
      break;
    case Mark::kWye:
      polygon(6, 1.0, std::numbers::pi, 0.38);
      break;
    case Mark::kCross:
      polygon(8, 1.0, std::numbers::pi / 4, 0.38);
      break;
    case Mark::kCircle:
      break;
  }
  return points;
}

}  // namespace

Canvas::Canvas(Format format, double width, double height)
    : width_(width),
      height_(height),
      surface_(make_surface(format, bytes_, width, height), cairo_surface_destroy),
      context_(cairo_create(surface_.get()), cairo_destroy) {}

Canvas::~Canvas() {
  // A page that is given up writes its rest into bytes_, which has to be there still.
  context_.reset();
  if (surface_) cairo_surface_finish(surface_.get());
}

void Canvas::use(const Color& color) {
  cairo_set_source_rgba(context_.get(), color.r, color.g, color.b, color.opacity);
}

void Canvas::use_font(double size, bool bold) {
  cairo_select_font_face(context_.get(), "DejaVu Sans", CAIRO_FONT_SLANT_NORMAL,
                         bold ? CAIRO_FONT_WEIGHT_BOLD : CAIRO_FONT_WEIGHT_NORMAL);
  cairo_set_font_size(context_.get(), size);
}

void Canvas::line(double x1, double y1, double x2, double y2, const Color& color, double thickness,
                  const std::vector<double>& dash) {
  polyline({{x1, y1}, {x2, y2}}, color, thickness, dash);
}

void Canvas::polyline(const std::vector<Point>& points, const Color& color, double thickness,
                      const std::vector<double>& dash) {
  if (points.size() < 2) return;
  cairo_t* context = context_.get();
  use(color);
  cairo_set_line_width(context, thickness);
  cairo_set_line_cap(context, CAIRO_LINE_CAP_BUTT);
  cairo_set_line_join(context, CAIRO_LINE_JOIN_ROUND);
  cairo_set_dash(context, dash.data(), static_cast<int>(dash.size()), 0);
  cairo_move_to(context, points.front().x, points.front().y);
  for (const Point& point : points) cairo_line_to(context, point.x, point.y);
  cairo_stroke(context);
  cairo_set_dash(context, nullptr, 0, 0);
}

void Canvas::stroke(Point a, Point b, const Color& color, double thickness) {
  cairo_t* context = context_.get();
  use(color);
  cairo_set_line_width(context, thickness);
  cairo_set_line_cap(context, CAIRO_LINE_CAP_ROUND);
  cairo_move_to(context, a.x, a.y);
  // A line of no length at all would have no ends either.
  cairo_line_to(context, b.x + (a.x == b.x && a.y == b.y ? 1e-3 : 0), b.y);
  cairo_stroke(context);
}

void Canvas::fill_rectangle(double x, double y, double width, double height, const Color& color) {
  use(color);
  cairo_rectangle(context_.get(), x, y, width, height);
  cairo_fill(context_.get());
}

void Canvas::outline_rectangle(double x, double y, double width, double height, const Color& color, double thickness) {
  use(color);
  cairo_set_line_width(context_.get(), thickness);
  cairo_rectangle(context_.get(), x, y, width, height);
  cairo_stroke(context_.get());
}

void Canvas::mark(Mark mark, Point at, double size, const Color& color, bool filled) {
  cairo_t* context = context_.get();
  const std::vector<Point> outline = corners(mark);
  cairo_new_path(context);
  if (outline.empty()) {
    cairo_arc(context, at.x, at.y, 0.56 * size, 0, 2 * std::numbers::pi);
  } else {
    for (const Point& point : outline) cairo_line_to(context, at.x + size * point.x, at.y + size * point.y);
  }
  cairo_close_path(context);
  use(filled ? color : Color{1, 1, 1});
  cairo_fill_preserve(context);
  use(filled ? Color{1, 1, 1} : color);
  cairo_set_line_width(context, filled ? 0.3 : 0.8);
  cairo_stroke(context);
}

void Canvas::cross(Point at, double size, const Color& color) {
  line(at.x - size / 2, at.y - size / 2, at.x + size / 2, at.y + size / 2, color, 1);
  line(at.x - size / 2, at.y + size / 2, at.x + size / 2, at.y - size / 2, color, 1);
}

double Canvas::text_width(const std::string& text, double size, bool bold) {
  use_font(size, bold);
  cairo_text_extents_t extents;
  cairo_text_extents(context_.get(), text.c_str(), &extents);
  return extents.x_advance;
}

void Canvas::text(const std::string& text, Point at, double size, Align align, const Color& color, bool bold,
                  double turn) {
  cairo_t* context = context_.get();
  const double width = text_width(text, size, bold);
  double shift = 0;
  if (align == Align::kMiddle) shift = -width / 2;
  if (align == Align::kRight) shift = -width;
  use(color);
  cairo_save(context);
  cairo_translate(context, at.x, at.y);
  cairo_rotate(context, -turn * std::numbers::pi / 180);
  cairo_move_to(context, shift, 0);
  cairo_show_text(context, text.c_str());
  cairo_restore(context);
}

void Canvas::clip(double x, double y, double width, double height) {
  cairo_save(context_.get());
  cairo_rectangle(context_.get(), x, y, width, height);
  cairo_clip(context_.get());
}

void Canvas::unclip() { cairo_restore(context_.get()); }

std::string Canvas::finish() {
  const cairo_status_t drawn = cairo_status(context_.get());
  context_.reset();
  cairo_surface_finish(surface_.get());
  const cairo_status_t written = cairo_surface_status(surface_.get());
  const cairo_status_t status = drawn != CAIRO_STATUS_SUCCESS ? drawn : written;
  if (status != CAIRO_STATUS_SUCCESS) {
    throw SystemError(fmt::format("cannot draw a figure: {}", cairo_status_to_string(status)));
  }
  // cairo numbers its surfaces from the process's start; equal drawings are to be equal bytes.
  constexpr std::string_view kNumbered = "<g id=\"surface";
  if (const size_t at = bytes_.find(kNumbered); at != std::string::npos) {
    bytes_.replace(at, bytes_.find('>', at) - at, "<g id=\"figure\"");
  }
  return bytes_;
}

void find_fonts() {
  namespace fs = std::filesystem;
  fs::path folder;
  try {
    folder = fs::path(assay_data_dir()) / "fonts";
  } catch (const InputError&) {
    return;  // models are somewhere else, and fonts the system's
  }
  std::error_code error;
  if (!fs::is_directory(folder, error)) return;
  if (!fs::exists("/etc/fonts/fonts.conf", error)) ::setenv("FONTCONFIG_FILE", (folder / "fonts.conf").c_str(), 0);
  FcConfigAppFontAddDir(nullptr, reinterpret_cast<const FcChar8*>(folder.c_str()));
}

void forget_fonts() {
  cairo_debug_reset_static_data();
  FcFini();
}

}  // namespace assay
