// docs/effects.md and its pictures against the catalogue.
#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>
#include <string>

#include "common/effects/catalogue.h"

namespace gapfarm::effect_docs_test {

using ::testing::HasSubstr;

const std::filesystem::path kDocs = std::filesystem::path(GAPFARM_SOURCE_DIR) / "docs";

std::string read(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

// From a heading of these marks ("##") that begins with the name to the next one.
std::string section_of(const std::string& page, const std::string& marks, const std::string& name) {
  const std::string heading = "\n" + marks + " ";
  std::size_t begin = page.find(heading + name + "\n");
  if (begin == std::string::npos) begin = page.find(heading + name + " ");
  if (begin == std::string::npos) return "";
  return page.substr(begin, page.find(heading, begin + 1) - begin);
}

// "| rate | 1/min | 0 | -0.05 to 0.05 |"
std::string row_of(const Effect& effect, std::size_t i) {
  const Parameter& p = effect.parameters[i];
  std::ostringstream row;
  row.precision(4);
  row << "| " << p.key << " | " << p.unit << " | ";
  if (i < effect.strengths) {
    row << p.nominal << " | ";
  } else {
    row << "- | ";
  }
  if (p.choices.empty()) {
    row << p.lower << " to " << p.upper << " |";
  } else {
    for (std::size_t c = 0; c < p.choices.size(); ++c) row << (c ? " or " : "") << p.choices[c];
    row << " |";
  }
  return row.str();
}

void expect_described(const std::string& section, const Effect& effect) {
  EXPECT_THAT(section, HasSubstr("Confused with: ")) << effect.name;
  for (std::size_t i = 0; i < effect.parameters.size(); ++i) {
    EXPECT_THAT(section, HasSubstr(row_of(effect, i))) << effect.name;
  }
}

TEST(EffectDocs, EveryRowOfTheCatalogueHasItsSectionWithItsParameters) {
  const std::string page = read(kDocs / "effects.md");
  for (const Effect& effect : srv1_effects()) {
    const std::string section = section_of(page, "##", effect.name);
    expect_described(section, effect);
    EXPECT_THAT(section, HasSubstr("](pictures/effects/" + effect.name + ".svg)"));
  }
  for (const Effect& effect : push_effects()) {
    expect_described(section_of(page, "###", effect.name), effect);
  }
}

TEST(EffectDocs, EveryRowHasAPictureAndNoPictureIsLeftOver) {
  std::size_t pictures = 0;
  for (const auto& entry : std::filesystem::directory_iterator(kDocs / "pictures" / "effects")) {
    pictures += entry.path().extension() == ".svg";
  }
  EXPECT_EQ(pictures, srv1_effects().size());
  for (const Effect& effect : srv1_effects()) {
    const std::string picture = read(kDocs / "pictures" / "effects" / (effect.name + ".svg"));
    EXPECT_EQ(picture.rfind("<svg ", 0), 0u) << effect.name;
    EXPECT_LT(picture.size(), 25000u) << effect.name;
    for (const char* command :
         {"forward", "backward", "turn_ccw", "turn_cw", "wide_ccw", "wide_cw"}) {
      EXPECT_THAT(picture, HasSubstr(">" + std::string(command) + "<")) << effect.name;
    }
  }
}

}  // namespace gapfarm::effect_docs_test
