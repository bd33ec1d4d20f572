// [[pieces]]: the flat pieces of scenarios that push them.
#include <algorithm>

#include "common/config/sections.h"
#include "common/trials/text/csv.h"

namespace gapfarm {
namespace {

// A pose in a log is that of the frame in which the corners are listed, or of the centroid.
const std::vector<std::string> kOrigins = {"frame", "centroid"};

std::optional<Eigen::Vector2d> read_corner(const toml::node& node) {
  const toml::array* pair = node.as_array();
  if (pair == nullptr || pair->size() != 2) return {};
  const auto x = (*pair)[0].value<double>();
  const auto y = (*pair)[1].value<double>();
  if (!x || !y) return {};
  return Eigen::Vector2d(*x, *y);
}

void read_corners(TomlSection& section, Piece& piece) {
  const toml::node* node = section.find("corners");
  if (node == nullptr) return;  // check_piece() misses them
  const toml::array* list = node->as_array();
  for (std::size_t i = 0; list != nullptr && i < list->size(); ++i) {
    const auto corner = read_corner((*list)[i]);
    if (!corner) {
      list = nullptr;
      break;
    }
    piece.corners.push_back(*corner);
  }
  if (list == nullptr) section.fail("corners", "corners are pairs in m: [[0, 0], [0.1, 0], ...]");
}

void read_piece(const toml::table& table, const toml::node& node, TomlErrors& errors,
                std::vector<Piece>& pieces) {
  TomlSection section(table, "[[pieces]]", errors);
  Piece piece;
  section.read("name", piece.name);
  read_corners(section, piece);
  const std::size_t origin = section.choice("origin", kOrigins).value_or(0);
  section.read("thickness", piece.thickness_m, 1e-4, 0.5, "m");
  section.read("mass", piece.mass_kg, 1e-4, 100, "kg");
  section.read("symmetry", piece.symmetry, 1, 16);
  section.finish();
  const bool twice = std::any_of(pieces.begin(), pieces.end(),
                                 [&](const Piece& other) { return other.name == piece.name; });
  if (twice) errors.add(node, "piece " + quoted_word(piece.name) + " is written twice");
  if (Status s = check_piece(piece); !s) {
    if (errors.empty()) errors.add(node, s.error().message);
    return;
  }
  if (origin == 1) {
    const Eigen::Vector2d middle = centroid(piece);
    for (Eigen::Vector2d& corner : piece.corners) corner -= middle;
  }
  pieces.push_back(std::move(piece));
}

}  // namespace

void read_pieces(TomlSection& top, const ScenarioForm& form, std::vector<Piece>& pieces,
                 std::vector<CommandSpec>& commands) {
  if (!form.pieces) return;
  const toml::node* node = top.find("pieces");
  const toml::array* list = node == nullptr ? nullptr : node->as_array();
  if (list == nullptr || list->empty()) {
    const std::string missing = std::string("scenario ") + form.name +
                                " needs sections [[pieces]] with name, corners, thickness and mass";
    top.errors().add(node == nullptr ? top.table().source().begin : node->source().begin, missing);
    return;
  }
  for (const toml::node& entry : *list) {
    if (const toml::table* table = entry.as_table()) {
      read_piece(*table, entry, top.errors(), pieces);
    } else {
      top.errors().add(entry, "pieces hold " + toml_type_name(entry) + ", expected [[pieces]]");
    }
  }
  for (const Piece& piece : pieces) commands.push_back({piece.name, 0, 0, 0});
}

}  // namespace gapfarm
