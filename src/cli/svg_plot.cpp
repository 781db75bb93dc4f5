// Small plots as SVG text.
#include "cli/svg_plot.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "ruedo/math.h"

namespace ruedo::cli {
namespace {

constexpr double kWidth = 720, kHeight = 440, kLeft = 68, kRight = 18, kTop = 40, kBottom = 52,
                 kRow = 19;  // pixels

// An axis from data to pixels.
struct Axis {
  double low = 0, high = 1, from = 0, to = 1;
  double at(double value) const { return from + (value - low) / (high - low) * (to - from); }

  // A round distance of ticks: 1, 2 or 5 times a power of ten, some six of them.
  double tick() const {
    const double rough = (high - low) / 6;
    const double power = math::pow(10.0, std::floor(math::log10(rough)));
    for (const double factor : {1.0, 2.0, 5.0}) {
      if (factor * power >= rough) return factor * power;
    }
    return 10 * power;
  }
};

std::string escaped(const std::string& text) {
  std::string result;
  for (const char c : text) {
    if (c == '<')
      result += "&lt;";
    else if (c == '&')
      result += "&amp;";
    else
      result += c;
  }
  return result;
}

void widen(Axis& axis, double share) {
  if (!(axis.high > axis.low)) axis = {axis.low - 0.5, axis.low + 0.5, axis.from, axis.to};
  const double margin = share * (axis.high - axis.low);
  axis.low -= margin;
  axis.high += margin;
}

}  // namespace

void SvgPlot::line(Points points, std::string colour, std::string label, bool dashed,
                   double width) {
  curves_.push_back({std::move(points), std::move(colour), std::move(label), dashed, false, width});
}

void SvgPlot::area(Points points, std::string colour) {
  curves_.push_back({std::move(points), std::move(colour), "", false, true, 0});
}

std::string SvgPlot::svg() const {
  const double bottom = equal_axes_ ? 640 : kHeight;  // of the plot; the legend comes below
  const auto labels = std::count_if(curves_.begin(), curves_.end(),
                                    [](const Curve& curve) { return !curve.label.empty(); });
  const double height = bottom + (labels > 0 ? kRow * static_cast<double>(labels) + 10 : 0);
  Axis x{1e300, -1e300, kLeft, kWidth - kRight}, y{1e300, -1e300, bottom - kBottom, kTop};
  for (const Curve& curve : curves_) {
    for (const auto& [px, py] : curve.points) {
      x.low = std::min(x.low, px);
      x.high = std::max(x.high, px);
      y.low = std::min(y.low, py);
      y.high = std::max(y.high, py);
    }
  }
  widen(x, 0.03);
  widen(y, 0.06);
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

  std::string out = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0} {1}\" "
      "font-family=\"sans-serif\" font-size=\"13\">\n"
      "<rect width=\"{0}\" height=\"{1}\" fill=\"white\"/>\n"
      "<text x=\"{2}\" y=\"24\" text-anchor=\"middle\" font-size=\"15\">{3}</text>\n",
      kWidth, height, 0.5 * (x.from + x.to), escaped(title_));
  const auto text = [&](double px, double py, const char* anchor, const std::string& what) {
    out += fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\">{}</text>\n", px, py,
                       anchor, escaped(what));
  };
  const auto stroke = [&](double x1, double y1, double x2, double y2, const char* colour) {
    out += fmt::format(
        "<line x1=\"{:.1f}\" y1=\"{:.1f}\" x2=\"{:.1f}\" y2=\"{:.1f}\" stroke=\"{}\"/>\n", x1, y1,
        x2, y2, colour);
  };
  const double tick = equal_axes_ ? std::max(x.tick(), y.tick()) : 0;
  for (const Axis* axis : {&x, &y}) {
    const double distance = equal_axes_ ? tick : axis->tick();
    for (double i = std::ceil(axis->low / distance); i * distance <= axis->high; ++i) {
      const double at = axis->at(i * distance);
      const std::string label = fmt::format("{:.6g}", i == 0 ? 0.0 : i * distance);
      if (axis == &x) {
        stroke(at, y.from, at, y.to, "#e4e4e4");
        text(at, y.from + 18, "middle", label);
      } else {
        stroke(x.from, at, x.to, at, "#e4e4e4");
        text(x.from - 8, at + 4, "end", label);
      }
    }
  }
  stroke(x.from, y.from, x.to, y.from, "#404040");
  stroke(x.from, y.from, x.from, y.to, "#404040");
  text(0.5 * (x.from + x.to), bottom - 12, "middle", x_label_);
  out += fmt::format(
      "<text transform=\"translate(18 {:.1f}) rotate(-90)\" text-anchor=\"middle\">{}</text>\n",
      0.5 * (y.from + y.to), escaped(y_label_));
  for (const Curve& curve : curves_) {
    std::string points;
    for (const auto& [px, py] : curve.points)
      points += fmt::format("{:.2f},{:.2f} ", x.at(px), y.at(py));
    if (curve.filled) {
      out += fmt::format("<polygon points=\"{}\" fill=\"{}\"/>\n", points, curve.colour);
    } else {
      out += fmt::format(
          "<polyline points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"{}\"{}/>\n", points,
          curve.colour, curve.width, curve.dashed ? " stroke-dasharray=\"6 4\"" : "");
    }
  }
  double row = bottom + 14;
  for (const Curve& curve : curves_) {
    if (curve.label.empty()) continue;
    const double from = x.from + 20;
    out += fmt::format(
        "<line x1=\"{:.1f}\" y1=\"{:.1f}\" x2=\"{:.1f}\" y2=\"{:.1f}\" stroke=\"{}\" "
        "stroke-width=\"2\"{}/>\n",
        from, row - 4, from + 26, row - 4, curve.colour,
        curve.dashed ? " stroke-dasharray=\"6 4\"" : "");
    text(from + 32, row, "start", curve.label);
    row += kRow;
  }
  return out + "</svg>\n";
}

}  // namespace ruedo::cli
