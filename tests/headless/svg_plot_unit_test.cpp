// Ticks of linear axes.
#include "server/headless/svg_plot.h"

#include <gtest/gtest.h>

#include <cmath>
#include <sstream>

namespace takt {
namespace {

std::string picture(double from, double to) {
  Plot plot;
  plot.lines = {{"", {{0.0, from}, {1.0, to}}}};
  std::ostringstream out;
  write_svg(out, plot);
  return out.str();
}

bool has_tick(const std::string& svg, const std::string& text) {
  return svg.find('>' + text + '<') != std::string::npos;
}

TEST(SvgPlot, TicksAreMultiplesOfRoundSteps) {
  const std::string svg = picture(-0.31, 0.52);
  for (const char* tick : {"-0.4", "-0.2", "0", "0.2", "0.4", "0.6"})
    EXPECT_TRUE(has_tick(svg, tick)) << tick;
  EXPECT_FALSE(has_tick(svg, "-0"));
}

// A step is then smaller than the distance of two numbers of their size.
TEST(SvgPlot, ValuesThatDifferInTheirLastDigitHaveTicksToo) {
  EXPECT_TRUE(has_tick(picture(1e9, std::nextafter(1e9, 2e9)), "1e+09"));
}

}  // namespace
}  // namespace takt
