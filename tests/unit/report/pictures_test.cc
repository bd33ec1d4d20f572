#include <gmock/gmock.h>

#include <boost/property_tree/ptree.hpp>
#include <boost/property_tree/xml_parser.hpp>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <numbers>
#include <regex>
#include <sstream>

#include "common/random/stream.h"
#include "master/report/figures/figures.h"
#include "master/report/run/run_report.h"

namespace gapfarm::pictures_test {

using ::testing::HasSubstr;
using ::testing::Not;

boost::property_tree::ptree parse(const std::string& svg) {
  std::istringstream text(svg);
  boost::property_tree::ptree tree;
  EXPECT_NO_THROW(boost::property_tree::read_xml(text, tree));
  return tree;
}

std::size_t count(const std::string& text, const std::string& part) {
  std::size_t n = 0;
  for (auto at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++n;
  return n;
}

// Keeps the picture for a person when GAPFARM_PICTURES names a folder.
void keep(const std::string& name, const std::string& svg) {
  if (const char* folder = std::getenv("GAPFARM_PICTURES")) {
    std::ofstream(std::string(folder) + "/" + name) << svg;
  }
}

Eigen::Matrix3d diagonal(double x, double y, double theta) {
  return Eigen::Vector3d(x * x, y * y, theta * theta).asDiagonal();
}

// A command whose real ends scatter around `truth`, with a poor and a good prediction.
PosePanel example_panel(const std::string& title, const Pose& truth, std::uint64_t id) {
  Stream stream({.run_seed = 7, .birth_id = id});
  PosePanel panel;
  panel.title = title;
  for (int i = 0; i < 60; ++i) {
    panel.measured.push_back(
        truth * Pose{0.010 * stream.normal(), 0.006 * stream.normal(), 0.07 * stream.normal()});
  }
  const Pose poor = Pose{truth.x * 1.15 - 0.012, truth.y * 1.2 + 0.01, truth.theta * 1.2};
  panel.clouds = {{"before: nominal parameters", poor, diagonal(0.012, 0.010, 0.1)},
                  {"after: best of the run", truth, diagonal(0.010, 0.006, 0.07)}};
  return panel;
}

TEST(PosePicture, ShowsEveryPanelTrialAndCloud) {
  const std::vector<PosePanel> panels = {
      example_panel("forward", {0.25, 0.005, 0.02}, 1),
      example_panel("backward", {-0.24, 0.0, -0.03}, 2),
      example_panel("turn_ccw", {0.004, 0.002, 1.6}, 3),
      example_panel("turn_cw", {0.003, -0.004, -1.55}, 4),
      example_panel("wide_ccw", {0.14, 0.07, 0.9}, 5),
      example_panel("wide_cw", {0.15, -0.06, -0.85}, 6),
  };
  const std::string svg = pose_picture(panels, "Measured and simulated end poses",
                                       "run/demo, 360 trials, log_score -3.21 to 4.56 nats/trial");
  keep("poses.svg", svg);
  keep("poses_one.svg", pose_picture({panels[0]}, "Measured and simulated end poses", "one"));
  parse(svg);
  for (const PosePanel& panel : panels) EXPECT_THAT(svg, HasSubstr(">" + panel.title + "<"));
  EXPECT_THAT(svg, HasSubstr("before: nominal parameters, 90 % ellipse"));
  // Every trial is a dot or counted as beyond; the legend shows one more dot.
  EXPECT_GE(count(svg, "r=\"2.3\""), 6 * 57u + 1);
  EXPECT_LE(count(svg, "r=\"2.3\""), 6 * 60u + 1);
}

TEST(PosePicture, CountsWhatLiesFarAway) {
  PosePanel panel = example_panel("forward", {0.25, 0, 0}, 1);
  const std::size_t dots = count(pose_picture({panel}, "t"), "<circle");
  panel.measured.push_back({3, 3, 0});
  const std::string svg = pose_picture({panel}, "t");
  EXPECT_EQ(count(svg, "<circle"), dots);
  EXPECT_THAT(svg, HasSubstr("61 trials, "));
  EXPECT_THAT(svg, HasSubstr("beyond the frame"));
}

// With one panel the title once ran out of the picture, and the note over the panel's title.
TEST(PosePicture, HasRoomForItsText) {
  const std::string title(98, 'm');
  PosePanel panel = example_panel("forward, 1 s", {0.25, 0, 0}, 1);
  const std::string svg = pose_picture({panel}, title);
  std::smatch width, name, note;
  ASSERT_TRUE(std::regex_search(svg, width, std::regex("width=\"([0-9.]+)\"")));
  EXPECT_GT(std::stod(width[1]), 98 * 10.0);
  ASSERT_TRUE(std::regex_search(svg, name, std::regex("y=\"([0-9.]+)\"[^>]*>forward, 1 s<")));
  ASSERT_TRUE(std::regex_search(svg, note, std::regex("y=\"([0-9.]+)\"[^>]*>60 trials")));
  EXPECT_GE(std::stod(note[1]) - std::stod(name[1]), 14);
}

TEST(PosePicture, BearsEmptyAndDegenerateInput) {
  parse(pose_picture({}, "nothing"));
  PosePanel panel;
  panel.title = "<empty>";
  parse(pose_picture({panel}, "no trials"));
  panel.measured = {{0.1, 0.1, 0}, {0.1, 0.1, 0}};
  panel.clouds = {{"flat", {0.1, 0.1, 0}, Eigen::Matrix3d::Zero()}};
  const std::string svg = pose_picture({panel}, "all at one place");
  parse(svg);
  EXPECT_THAT(svg, Not(HasSubstr("nan")));
}

TEST(FitnessChart, ShowsARunOfEitherSense) {
  RunReport report;
  report.fitness = "robust_mahalanobis";
  report.unit = "-";
  report.higher_is_better = false;
  for (std::uint64_t g = 1; g <= 60; ++g) {
    const double t = static_cast<double>(g);
    const double best = 0.03 + 3 * std::exp(-t / 8);
    report.generations.push_back({.generation = g,
                                  .best = best,
                                  .median = best + 0.8 * std::exp(-t / 20),
                                  .worst = best + 6 * std::exp(-t / 30)});
  }
  report.generations[10].best = {};  // nobody was OK
  const std::string svg = fitness_chart(report);
  keep("fitness.svg", svg);
  parse(svg);
  EXPECT_EQ(count(svg, "<polyline"), 2u);
  EXPECT_THAT(svg, HasSubstr("robust_mahalanobis, lower is better"));
  report.fitness = "log_score";
  report.unit = "nats/trial";
  report.higher_is_better = true;
  EXPECT_THAT(fitness_chart(report), HasSubstr("log_score (nats/trial), higher is better"));
  report.generations.resize(1);
  parse(fitness_chart(report));
  parse(fitness_chart(RunReport()));
}

}  // namespace gapfarm::pictures_test
