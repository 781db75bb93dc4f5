// Small plots as SVG text.
#include "report/svg_plot.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "base/xml.h"
#include "ruedo/math.h"

namespace ruedo::report {
namespace {

constexpr double kWidth = 720, kHeight = 440, kLeft = 68, kRight = 18, kTop = 40, kBottom = 52,
                 kRow = 19;  // pixels

constexpr const char *kGridColour = "#e4e4e4", *kAxisColour = "#404040",
                     *kDashes = " stroke-dasharray=\"6 4\"";

std::string text(double x, double y, const char* anchor, const std::string& what) {
  return fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\">{}</text>\n", x, y, anchor,
                     xml_escaped(what));
}

std::string stroke(double x1, double y1, double x2, double y2, const char* colour) {
  return fmt::format(
      "<line x1=\"{:.1f}\" y1=\"{:.1f}\" x2=\"{:.1f}\" y2=\"{:.1f}\" stroke=\"{}\"/>\n", x1, y1, x2,
      y2, colour);
}

}  // namespace

// 1, 2 or 5 times a power of ten, some six of them.
double SvgPlot::Axis::tick() const {
  const double rough = (high - low) / 6;
  const double power = math::pow(10.0, std::floor(math::log10(rough)));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (factor * power >= rough) return factor * power;
  }
  return 10 * power;
}

void SvgPlot::Axis::widen(double share) {
  if (!(high > low)) {
    low -= 0.5;
    high += 0.5;
  }
  const double margin = share * (high - low);
  low -= margin;
  high += margin;
}

void SvgPlot::line(Points points, std::string colour, std::string label, bool dashed,
                   double width) {
  curves_.push_back({std::move(points), std::move(colour), std::move(label), dashed, false, width});
}

void SvgPlot::area(Points points, std::string colour) {
  curves_.push_back({std::move(points), std::move(colour), "", false, true, 0});
}

// The curves' limits with a margin, over the pixels from the left and up from `bottom`.
SvgPlot::Axes SvgPlot::axes(double bottom) const {
  Axes axes{{1e300, -1e300, kLeft, kWidth - kRight}, {1e300, -1e300, bottom - kBottom, kTop}};
  auto& [x, y] = axes;
  for (const Curve& curve : curves_) {
    for (const auto& [px, py] : curve.points) {
      x.low = std::min(x.low, px);
      x.high = std::max(x.high, px);
      y.low = std::min(y.low, py);
      y.high = std::max(y.high, py);
    }
  }
  x.widen(0.03);
  y.widen(0.06);
  if (equal_axes_) {
    const double scale =
        std::min((x.to - x.from) / (x.high - x.low), (y.from - y.to) / (y.high - y.low));
    for (Axis* axis : {&x, &y}) {
      const double middle = 0.5 * (axis->low + axis->high),
                   half = 0.5 * std::abs(axis->to - axis->from) / scale;
      axis->low = middle - half;
      axis->high = middle + half;
    }
  }
  return axes;
}

std::string SvgPlot::grid(const Axes& axes) const {
  const auto& [x, y] = axes;
  const double equal = equal_axes_ ? std::max(x.tick(), y.tick()) : 0;
  const auto each_tick = [&](const Axis& axis, const auto& draw) {
    const double distance = equal_axes_ ? equal : axis.tick();
    for (double i = std::ceil(axis.low / distance); i * distance <= axis.high; ++i)
      draw(axis.at(i * distance), fmt::format("{:.6g}", i == 0 ? 0.0 : i * distance));
  };
  std::string out;
  each_tick(x, [&](double at, const std::string& label) {
    out += stroke(at, y.from, at, y.to, kGridColour) + text(at, y.from + 18, "middle", label);
  });
  each_tick(y, [&](double at, const std::string& label) {
    out += stroke(x.from, at, x.to, at, kGridColour) + text(x.from - 8, at + 4, "end", label);
  });
  out += stroke(x.from, y.from, x.to, y.from, kAxisColour) +
         stroke(x.from, y.from, x.from, y.to, kAxisColour) +
         text(0.5 * (x.from + x.to), y.from + kBottom - 12, "middle", x_label_);
  return out + fmt::format(
                   "<text transform=\"translate(18 {:.1f}) rotate(-90)\" "
                   "text-anchor=\"middle\">{}</text>\n",
                   0.5 * (y.from + y.to), xml_escaped(y_label_));
}

std::string SvgPlot::drawn(const Curve& curve, const Axes& axes) {
  std::string points;
  for (const auto& [px, py] : curve.points)
    points += fmt::format("{:.2f},{:.2f} ", axes.x.at(px), axes.y.at(py));
  if (curve.filled)
    return fmt::format("<polygon points=\"{}\" fill=\"{}\"/>\n", points, curve.colour);
  return fmt::format(
      "<polyline points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"{}\"{}/>\n", points,
      curve.colour, curve.width, curve.dashed ? kDashes : "");
}

std::string SvgPlot::legend(double left, double row) const {
  std::string out;
  for (const Curve& curve : curves_) {
    if (curve.label.empty()) continue;
    out += fmt::format(
        "<line x1=\"{:.1f}\" y1=\"{:.1f}\" x2=\"{:.1f}\" y2=\"{:.1f}\" stroke=\"{}\" "
        "stroke-width=\"2\"{}/>\n",
        left, row - 4, left + 26, row - 4, curve.colour, curve.dashed ? kDashes : "");
    out += text(left + 32, row, "start", curve.label);
    row += kRow;
  }
  return out;
}

std::string SvgPlot::svg() const {
  const double bottom = equal_axes_ ? 640 : kHeight;  // of the plot; the legend comes below
  const auto labels = std::count_if(curves_.begin(), curves_.end(),
                                    [](const Curve& curve) { return !curve.label.empty(); });
  const double height = bottom + (labels > 0 ? kRow * static_cast<double>(labels) + 10 : 0);
  const Axes axes = this->axes(bottom);
  std::string out = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0} {1}\" "
      "font-family=\"sans-serif\" font-size=\"13\">\n"
      "<rect width=\"{0}\" height=\"{1}\" fill=\"white\"/>\n"
      "<text x=\"{2}\" y=\"24\" text-anchor=\"middle\" font-size=\"15\">{3}</text>\n",
      kWidth, height, 0.5 * (axes.x.from + axes.x.to), xml_escaped(title_));
  out += grid(axes);
  for (const Curve& curve : curves_) out += drawn(curve, axes);
  return out + legend(axes.x.from + 20, bottom + 14) + "</svg>\n";
}

}  // namespace ruedo::report
