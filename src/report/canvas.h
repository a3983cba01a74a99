// A page to draw on that becomes an SVG or a PDF. Lengths are points (1/72 inch), y goes down, angles are degrees.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "results/color.h"
#include "results/looks.h"

// of cairo.h, whose names they are
struct _cairo;          // NOLINT(bugprone-reserved-identifier)
struct _cairo_surface;  // NOLINT(bugprone-reserved-identifier)

namespace assay {

enum class Format { kSvg, kPdf };
enum class Align { kLeft, kMiddle, kRight };

class Canvas {
 public:
  Canvas(Format format, double width, double height);
  Canvas(const Canvas&) = delete;
  Canvas& operator=(const Canvas&) = delete;
  ~Canvas();

  double width() const { return width_; }
  double height() const { return height_; }

  void line(double x1, double y1, double x2, double y2, const Color& color, double thickness,
            const std::vector<double>& dash = {});
  // Through all points, with round joins.
  struct Point {
    double x = 0, y = 0;
  };
  void polyline(const std::vector<Point>& points, const Color& color, double thickness,
                const std::vector<double>& dash = {});
  // A line with round ends.
  void stroke(Point a, Point b, const Color& color, double thickness);
  void fill_rectangle(double x, double y, double width, double height, const Color& color);
  void outline_rectangle(double x, double y, double width, double height, const Color& color, double thickness);
  // Filled, or hollow.
  void mark(Mark mark, Point at, double size, const Color& color, bool filled = true);
  // x: a failure.
  void cross(Point at, double size, const Color& color);
  // `at` is on the baseline; `turn` counts anticlockwise.
  void text(const std::string& text, Point at, double size, Align align, const Color& color, bool bold = false,
            double turn = 0);
  double text_width(const std::string& text, double size, bool bold = false);
  // Until unclip() nothing is drawn outside.
  void clip(double x, double y, double width, double height);
  void unclip();

  // The whole file; nothing can be drawn after. Throws SystemError when the drawing failed.
  std::string finish();

 private:
  void use(const Color& color);
  void use_font(double size, bool bold);

  std::string bytes_;
  double width_ = 0, height_ = 0;
  std::unique_ptr<_cairo_surface, void (*)(_cairo_surface*)> surface_;
  std::unique_ptr<_cairo, void (*)(_cairo*)> context_;
};

// Before the first canvas: `fonts` in assay_data_dir(), where an installed assay brings them, because a machine without
// a desktop has none.
void find_fonts();

// Gives back what drawing keeps for the next time: fonts. No canvas may be there.
void forget_fonts();

}  // namespace assay
