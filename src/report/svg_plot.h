// Small plots as SVG text: lines and filled outlines over two axes with ticks, a grid and a legend.
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace ruedo::report {

using Points = std::vector<std::pair<double, double>>;

class SvgPlot {
 public:
  // equal_axes: one unit is as long on both axes (maps).
  SvgPlot(std::string title, std::string x_label, std::string y_label, bool equal_axes = false)
      : title_(std::move(title)),
        x_label_(std::move(x_label)),
        y_label_(std::move(y_label)),
        equal_axes_(equal_axes) {}

  // Joined by straight lines; an empty label stays out of the legend. colour: any that SVG knows.
  void line(Points points, std::string colour, std::string label = "", bool dashed = false,
            double width = 1.6);
  // A closed outline, filled.
  void area(Points points, std::string colour);

  std::string svg() const;

 private:
  struct Curve {
    Points points;
    std::string colour, label;
    bool dashed = false, filled = false;
    double width = 1.6;
  };
  // From data to pixels.
  struct Axis {
    double low, high, from, to;
    double at(double value) const { return from + (value - low) / (high - low) * (to - from); }
    double tick() const;  // a round distance of ticks
    void widen(double share);
  };
  struct Axes {
    Axis x, y;
  };
  Axes axes(double bottom) const;
  std::string grid(const Axes& axes) const;
  static std::string drawn(const Curve& curve, const Axes& axes);
  std::string legend(double left, double row) const;

  std::string title_, x_label_, y_label_;
  bool equal_axes_;
  std::vector<Curve> curves_;
};

}  // namespace ruedo::report
