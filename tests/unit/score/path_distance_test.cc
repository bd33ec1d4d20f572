#include "common/math/path_distance.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cassert>
#include <charconv>
#include <cmath>
#include <vector>

#include "common/random/stream.h"
#include "common/trials/files.h"
#include "common/trials/text/csv.h"
#include "tests/unit/trials/shared_data.h"

namespace gapfarm::path_distance_test {

using Points = std::vector<PathPoint>;

Points line(int count, double y, double step = 1) {
  Points points;
  for (int i = 0; i < count; ++i) points.emplace_back(step * i, y, 0);
  return points;
}

// The leash of the walk that always takes the step after which it is shortest: an upper bound of
// frechet_distance(), and what the published "Frechet" figures are.
double greedy_frechet_bound(std::span<const PathPoint> a, std::span<const PathPoint> b) {
  assert(!a.empty() && !b.empty());
  std::size_t i = 0, j = 0;
  double leash = (a[0] - b[0]).norm();
  while (i + 1 < a.size() || j + 1 < b.size()) {
    const auto length = [&](std::size_t di, std::size_t dj) {
      return i + di < a.size() && j + dj < b.size() ? (a[i + di] - b[j + dj]).norm() : INFINITY;
    };
    const double both = length(1, 1), first = length(1, 0), second = length(0, 1);
    const bool step_both = both <= first && both <= second;
    if (step_both || first <= second) ++i;
    if (step_both || second < first) ++j;
    leash = std::max(leash, std::min({both, first, second}));
  }
  return leash;
}

TEST(PathDistance, ParallelLinesAreTheirGapApart) {
  const Points a = line(11, 0), b = line(11, 3);
  for (const auto distance :
       {lettier_distance, hausdorff_distance, frechet_distance, greedy_frechet_bound}) {
    EXPECT_EQ(distance(a, b), 3);
    EXPECT_EQ(distance(a, a), 0);
  }
}

// The same set of points walked the other way.
TEST(PathDistance, OnlyHausdorffForgetsTheOrder) {
  const Points a = line(11, 0);
  const Points back(a.rbegin(), a.rend());
  EXPECT_EQ(hausdorff_distance(a, back), 0);
  EXPECT_EQ(lettier_distance(a, back), 10);
  EXPECT_EQ(frechet_distance(a, back), 10);
}

TEST(PathDistance, OnlyLettiersMindsHowAPathIsSampled) {
  const Points coarse = line(11, 0), fine = line(41, 0, 0.25);
  EXPECT_EQ(lettier_distance(coarse, fine), 7.5) << "at index 10 of both";
  EXPECT_LE(hausdorff_distance(coarse, fine), 0.5);
  EXPECT_LE(frechet_distance(coarse, fine), 0.5);
}

TEST(PathDistance, TheShorterPathWaitsAtItsEnd) {
  EXPECT_EQ(lettier_distance(line(4, 0), line(9, 0)), 5);
  EXPECT_EQ(lettier_distance(line(9, 0), line(4, 0)), 5);
}

// A spike that only one path has: the leash must reach from its top to the other path.
TEST(PathDistance, FrechetOfASpike) {
  const Points flat = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}};
  const Points spike = {{0, 0, 0}, {1, 4, 0}, {2, 0, 0}};
  EXPECT_EQ(frechet_distance(flat, spike), 4);
  EXPECT_NEAR(hausdorff_distance(flat, spike), 4, 1e-12);
}

Points random_path(std::uint64_t seed) {
  Stream stream({.run_seed = seed});
  Points points(5 + stream.below(20), PathPoint::Zero());
  for (PathPoint& p : points) p = {stream.normal(), stream.normal(), stream.normal()};
  return points;
}

// All walks of two short paths, tried one by one.
double best_walk(const Points& a, const Points& b, std::size_t i, std::size_t j) {
  const double here = (a[i] - b[j]).norm();
  if (i + 1 == a.size() && j + 1 == b.size()) return here;
  double best = INFINITY;
  if (i + 1 < a.size()) best = std::min(best, best_walk(a, b, i + 1, j));
  if (j + 1 < b.size()) best = std::min(best, best_walk(a, b, i, j + 1));
  if (i + 1 < a.size() && j + 1 < b.size()) best = std::min(best, best_walk(a, b, i + 1, j + 1));
  return std::max(here, best);
}

TEST(PathDistance, FrechetIsTheBestOfAllWalks) {
  for (std::uint64_t seed = 0; seed < 40; ++seed) {
    Points a = random_path(2 * seed), b = random_path(2 * seed + 1);
    a.resize(std::min<std::size_t>(a.size(), 6), PathPoint::Zero());
    b.resize(std::min<std::size_t>(b.size(), 5), PathPoint::Zero());
    EXPECT_EQ(frechet_distance(a, b), best_walk(a, b, 0, 0)) << seed;
  }
}

TEST(PathDistance, AreSymmetricAndOrdered) {
  for (std::uint64_t seed = 0; seed < 50; ++seed) {
    const Points a = random_path(2 * seed), b = random_path(2 * seed + 1),
                 c = random_path(seed + 999);
    EXPECT_EQ(hausdorff_distance(a, b), hausdorff_distance(b, a));
    EXPECT_EQ(frechet_distance(a, b), frechet_distance(b, a));
    EXPECT_EQ(lettier_distance(a, b), lettier_distance(b, a));
    EXPECT_LE(hausdorff_distance(a, b), frechet_distance(a, b) + 1e-12);
    EXPECT_LE(frechet_distance(a, b), greedy_frechet_bound(a, b));
    EXPECT_LE(frechet_distance(a, b), lettier_distance(a, b)) << "waiting at the end is a walk";
    EXPECT_LE(frechet_distance(a, c), frechet_distance(a, b) + frechet_distance(b, c) + 1e-12);
  }
}

double number(const std::string& text) {
  double value = NAN;
  std::from_chars(text.data(), text.data() + text.size(), value);
  return value;
}

Points read_ball(const std::filesystem::path& file) {
  const std::string path = file.string();
  const auto rows = parse_csv(read_text_file(path).value(), path).value();
  Points points;
  for (std::size_t i = 1; i < rows.size(); ++i) {
    const auto& f = rows[i].fields;
    points.emplace_back(number(f.at(1).text), number(f.at(2).text), number(f.at(3).text));
  }
  return points;
}

// The distances of Lettier's racquetball paths to the standard, as published.  Commas within file
// names are not quoted.
TEST(PublishedPaths, AreReproduced) {
  const auto folder = shared_data("racquetball");
  if (!folder) GTEST_SKIP() << "no shared data";
  const Points standard = read_ball(*folder / "2013_11_22_00_18_36.Standard_See_README.csv");
  const std::string table = read_text_file((*folder / "published.csv").string()).value();
  std::size_t begun = table.find('\n') + 1;
  int files = 0;
  for (std::size_t end; (end = table.find('\n', begun)) != std::string::npos; begun = end + 1) {
    const std::string row = table.substr(begun, end - begun);
    const std::size_t second = row.rfind(','), first = row.rfind(',', second - 1);
    const std::string file = row.substr(0, first);
    const Points path = read_ball(*folder / file);
    EXPECT_NEAR(lettier_distance(standard, path), number(row.substr(first + 1, second)), 1e-9)
        << file;
    EXPECT_NEAR(hausdorff_distance(standard, path), number(row.substr(second + 1)), 1e-9) << file;
    const double frechet = frechet_distance(standard, path);
    const double greedy = greedy_frechet_bound(standard, path);
    EXPECT_LE(frechet, greedy) << file;
    if (file.find("Substeps_50") != std::string::npos) {
      EXPECT_NEAR(greedy, 17.071, 5e-4) << "printed as the Frechet distance";
      EXPECT_NEAR(frechet, 12.464, 5e-4);
    }
    std::cout << file.substr(20) << ": Frechet " << frechet << ", greedy bound " << greedy << "\n";
    ++files;
  }
  EXPECT_EQ(files, 22);
}

}  // namespace gapfarm::path_distance_test
