#pragma once
// Curves over one quantity as a picture (SVG), for tables of studies and the page of a run.
#include <iosfwd>
#include <string>
#include <utility>
#include <vector>

namespace takt {

struct PlotLine {
  std::string name;  ///< in the legend; empty: not there
  std::vector<std::pair<double, double>> points;
};

struct Plot {
  std::string title, x, y;  ///< with units
  std::string legend;       ///< quantity of the lines' names; may be empty
  std::vector<PlotLine> lines;
  bool markers = false;  ///< a circle at each point
  double width = 720.0, height = 440.0;
  bool logarithmic = false;  ///< both axes; points that are not positive are left out
};

void write_svg(std::ostream& out, const Plot& plot);

/// A picture with text in the colour of its surroundings; ends with "</svg>".
void begin_svg(std::ostream& out, double width, double height);

}  // namespace takt
