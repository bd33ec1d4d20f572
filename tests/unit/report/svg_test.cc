#include "common/svg/svg.h"

#include <gmock/gmock.h>

#include <boost/property_tree/ptree.hpp>
#include <boost/property_tree/xml_parser.hpp>
#include <cmath>
#include <sstream>

namespace gapfarm::svg_test {

using ::testing::DoubleNear;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

TEST(Svg, IsXmlWhateverTheText) {
  Svg svg(100, 50);
  svg.text({1, 2}, "a < b & \"c\" > d\x01", {});
  svg.line({0, 0}, {std::nan(""), 1e300}, {.stroke = "#000000"});
  svg.polyline({}, {.stroke = "#000000"});
  svg.begin_clip({0, 0}, 10, 10);
  svg.end_part();
  std::istringstream text(svg.finish());
  boost::property_tree::ptree tree;
  ASSERT_NO_THROW(boost::property_tree::read_xml(text, tree));
  EXPECT_EQ(tree.get<std::string>("svg.text"), "a < b & \"c\" > d ");
  EXPECT_EQ(tree.get<double>("svg.<xmlattr>.width"), 100);
  EXPECT_THAT(svg.finish(), Not(HasSubstr("nan")));
}

TEST(AxisTicks, AreRoundAndInside) {
  EXPECT_THAT(axis_ticks(0, 100, 5), ElementsAre(0, 20, 40, 60, 80, 100));
  EXPECT_THAT(axis_ticks(-0.31, 0.32, 3),
              ElementsAre(DoubleNear(-0.2, 1e-12), DoubleNear(0, 1e-12), DoubleNear(0.2, 1e-12)));
  EXPECT_TRUE(axis_ticks(1, 1, 5).empty());
  for (double span = 1e-6; span < 1e7; span *= 3.7) {
    const auto ticks = axis_ticks(-0.3 * span, 0.7 * span, 5);
    EXPECT_GE(ticks.size(), 2u) << span;
    EXPECT_LE(ticks.size(), 7u) << span;
  }
}

TEST(TickLabel, HasTheDigitsItNeeds) {
  EXPECT_EQ(tick_label(250, 50), "250");
  EXPECT_EQ(tick_label(0.25, 0.05), "0.25");
  EXPECT_EQ(tick_label(-0.5, 0.5), "\u22120.5");
  EXPECT_EQ(tick_label(-1e-17, 0.1), "0");
}

}  // namespace gapfarm::svg_test
