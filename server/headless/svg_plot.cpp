#include "server/headless/svg_plot.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <ostream>

#include "idl/common/text.h"
#include "idl/common/xml.h"

namespace takt {

namespace {

/// An axis between two ends with round numbers.
class Axis {
 public:
  struct Tick {
    double part;  ///< of the axis
    std::string text;
  };

  Axis(double least, double most, bool logarithmic) : logarithmic_(logarithmic) {
    if (logarithmic)
      make_decades(least, most);
    else
      make_steps(least, most);
  }
  double part(double value) const {
    return ((logarithmic_ ? std::log10(value) : value) - lower_) / (upper_ - lower_);
  }
  const std::vector<Tick>& ticks() const { return ticks_; }

 private:
  void make_steps(double least, double most) {
    if (!(most > least)) {
      const double room = least != 0.0 ? 0.1 * std::abs(least) : 1.0;
      least -= room;
      most += room;
    }
    const double raw = (most - least) / 5.0;
    const double power = std::pow(10.0, std::floor(std::log10(raw)));
    double step = power;
    for (const double factor : {2.0, 5.0, 10.0})
      if (step < raw) step = factor * power;
    const auto first = std::llround(std::floor(least / step + 1e-9)),
               last = std::llround(std::ceil(most / step - 1e-9));
    lower_ = step * static_cast<double>(first);
    upper_ = step * static_cast<double>(last);
    for (auto k = first; k <= last; ++k) {
      const double v = step * static_cast<double>(k);
      ticks_.push_back({part(v), number_text(v, 6)});
    }
  }

  /// Ticks at 1, 2 and 5 times powers of ten, or at powers alone where these are many.
  void make_decades(double least, double most) {
    constexpr std::array<double, 3> kTicks{1.0, 2.0, 5.0};
    const int first = static_cast<int>(std::floor(std::log10(least))),
              last = static_cast<int>(std::floor(std::log10(most))) + 1;
    std::vector<double> values;
    for (int decade = first; decade <= last; ++decade)
      for (const double tick : kTicks) values.push_back(tick * std::pow(10.0, decade));
    // The ticks just outside of the ends.
    constexpr double kSame = 1.0 + 1e-9;
    const auto begin = std::prev(std::upper_bound(values.begin(), values.end(), least * kSame));
    auto end = std::lower_bound(values.begin(), values.end(), most / kSame);
    if (end <= begin) end = std::next(begin);
    lower_ = std::log10(*begin), upper_ = std::log10(*end);
    const double every = std::max(1.0, std::ceil((upper_ - lower_) / 7.0));
    for (auto value = begin; value <= end; ++value) {
      const double exponent = std::log10(*value), power = std::round(exponent);
      const bool whole = std::abs(exponent - power) < 1e-6;
      if (upper_ - lower_ > 2.0 && (!whole || std::remainder(power, every) != 0.0)) continue;
      ticks_.push_back({part(*value), number_text(*value, 6)});
    }
  }

  bool logarithmic_;
  double lower_ = 0.0, upper_ = 1.0;
  std::vector<Tick> ticks_;
};

constexpr double kLeft = 90.0, kRight = 170.0, kTop = 40.0, kBottom = 60.0;
constexpr std::size_t kMaxNames = 18;  // in the legend

}  // namespace

void begin_svg(std::ostream& out, double width, double height) {
  out << "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"" << width << "\" height=\"" << height
      << "\" viewBox=\"0 0 " << width << ' ' << height
      << "\" fill=\"currentColor\" font-family=\"sans-serif\" font-size=\"12\">\n";
}

void write_svg(std::ostream& out, const Plot& plot) {
  const auto drawn = [&](const std::pair<double, double>& p) {
    return !plot.logarithmic || (p.first > 0.0 && p.second > 0.0);
  };
  double x_lower = std::numeric_limits<double>::infinity(), x_upper = -x_lower;
  double y_lower = x_lower, y_upper = -x_lower;
  for (const PlotLine& line : plot.lines)
    for (const auto& point : line.points) {
      if (!drawn(point)) continue;
      const auto& [px, py] = point;
      x_lower = std::min(x_lower, px), x_upper = std::max(x_upper, px);
      y_lower = std::min(y_lower, py), y_upper = std::max(y_upper, py);
    }
  if (!(x_lower <= x_upper)) x_lower = y_lower = plot.logarithmic ? 0.1 : 0.0, x_upper = y_upper = 1.0;
  const Axis across(x_lower, x_upper, plot.logarithmic), up(y_lower, y_upper, plot.logarithmic);
  const double w = plot.width - kLeft - kRight, h = plot.height - kTop - kBottom;
  const auto at_x = [&](double value) { return kLeft + w * across.part(value); };
  const auto at_y = [&](double value) { return kTop + h * (1.0 - up.part(value)); };
  const auto place = [](double value) { return fixed_text(value, 1); };
  begin_svg(out, plot.width, plot.height);
  out << "<rect class=\"paper\" width=\"100%\" height=\"100%\" fill=\"white\"/>\n"
      << "<text x=\"" << kLeft << "\" y=\"24\" font-size=\"15\">" << xml_escaped(plot.title) << "</text>\n";
  for (const Axis::Tick& tick : across.ticks()) {
    const std::string x = place(kLeft + w * tick.part);
    out << "<path d=\"M" << x << ' ' << kTop << " V" << kTop + h
        << "\" stroke=\"#888\" stroke-opacity=\"0.3\"/><text text-anchor=\"middle\" x=\"" << x << "\" y=\""
        << kTop + h + 18 << "\">" << tick.text << "</text>\n";
  }
  for (const Axis::Tick& tick : up.ticks()) {
    const double y = kTop + h * (1.0 - tick.part);
    out << "<path d=\"M" << kLeft << ' ' << place(y) << " H" << kLeft + w
        << "\" stroke=\"#888\" stroke-opacity=\"0.3\"/><text text-anchor=\"end\" x=\"" << kLeft - 6
        << "\" y=\"" << place(y + 4) << "\">" << tick.text << "</text>\n";
  }
  out << "<text text-anchor=\"middle\" x=\"" << kLeft + w / 2 << "\" y=\"" << plot.height - 14 << "\">"
      << xml_escaped(plot.x) << "</text>\n<text text-anchor=\"middle\" transform=\"translate(18 "
      << kTop + h / 2 << ") rotate(-90)\">" << xml_escaped(plot.y) << "</text>\n";
  // Those of takt view's page, which another page may replace by its theme's.
  constexpr std::array<const char*, 6> kColors{"#1953bb", "#e96c03", "#00a86b",
                                               "#d26fb4", "#64410a", "#2a2f37"};
  constexpr std::array<const char*, 3> kDashes{"", "6 4", "2 3"};
  for (std::size_t l = 0; l < plot.lines.size(); ++l) {
    const auto& [name, points] = plot.lines[l];
    out << "<g class=\"c" << l % kColors.size() << "\" color=\"" << kColors[l % kColors.size()]
        << "\">\n<polyline fill=\"none\" stroke-width=\"1.5\" stroke=\"currentColor\" stroke-dasharray=\""
        << kDashes[l / kColors.size() % kDashes.size()] << "\" points=\"";
    for (const auto& point : points)
      if (drawn(point)) out << place(at_x(point.first)) << ',' << place(at_y(point.second)) << ' ';
    out << "\"/>\n";
    if (plot.markers)
      for (const auto& point : points)
        if (drawn(point))
          out << "<circle r=\"2.5\" fill=\"currentColor\" cx=\"" << place(at_x(point.first)) << "\" cy=\""
              << place(at_y(point.second)) << "\"/>\n";
    if (!name.empty() && l < kMaxNames)
      out << "<text fill=\"currentColor\" x=\"" << kLeft + w + 12 << "\" y=\""
          << kTop + 16.0 * static_cast<double>(l + 1) << "\">" << xml_escaped(name) << "</text>\n";
    out << "</g>\n";
  }
  if (!plot.legend.empty())
    out << "<text x=\"" << kLeft + w + 12 << "\" y=\"" << kTop - 2 << "\">" << xml_escaped(plot.legend)
        << "</text>\n";
  out << "</svg>\n";
}

}  // namespace takt
