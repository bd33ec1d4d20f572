#include "master/ground/fit/fit_file.h"

#include <fstream>
#include <nlohmann/json.hpp>

#include "common/json/fields.h"

namespace gapfarm {
namespace {

// None where the line has no list there.
std::optional<std::vector<double>> numbers(const Json& line, const char* key) {
  if (!line.is_object() || !line.contains(key)) return {};
  std::vector<double> all;
  FieldReader(line).field(key, all);
  return all;
}

// Column by column.
template <class Matrix>
std::vector<double> flat(const Matrix& matrix) {
  return {matrix.data(), matrix.data() + matrix.size()};
}

}  // namespace

LineFile::LineFile(std::filesystem::path file) : file_(std::move(file)) {
  std::ifstream from(file_);
  for (std::string text; std::getline(from, text);) {
    const Json line = parse_json(text);
    if (!line.is_object() || !line.contains("key") || !line["key"].is_string()) continue;
    lines_[line["key"].get<std::string>()] = text;
  }
}

Json LineFile::line(const std::string& key) const {
  const auto found = lines_.find(key);
  return found == lines_.end() ? Json() : parse_json(found->second);
}

void LineFile::add(const std::string& key, Json line) {
  line["key"] = key;
  // Begins a line: whatever broke off is over.
  std::ofstream(file_, std::ios::app) << "\n" + (lines_[key] = json_text(line)) + "\n";
}

void LineFile::remove() {
  std::error_code ignored;
  std::filesystem::remove(file_, ignored);
}

std::optional<KeptFit> FitFile::find(const std::string& key) {
  const Json kept = line(key);
  const auto values = numbers(kept, "values"), scales = numbers(kept, "scales");
  if (!values || !scales || scales->size() % 3 != 0) return {};
  KeptFit fit{Eigen::VectorXd::Map(values->data(), values->size()), {}};
  for (std::size_t i = 0; i < scales->size(); i += 3) {
    fit.scales.emplace_back(Eigen::Vector3d::Map(scales->data() + i));
  }
  return fit;
}

void FitFile::keep(const std::string& key, const KeptFit& fit) {
  std::vector<double> scales;
  for (const Eigen::Vector3d& s : fit.scales) scales.insert(scales.end(), s.begin(), s.end());
  add(key, {{"values", flat(fit.values)}, {"scales", scales}});
}

std::optional<Result<OffsetFit>> RunCache::find(const std::string& key) const {
  const Json kept = line(key);
  if (kept.is_object() && kept.contains("error") && kept["error"].is_string()) {
    return Error{kept["error"].get<std::string>()};
  }
  const auto values = numbers(kept, "values"), covariance = numbers(kept, "covariance");
  if (!values || !covariance || covariance->size() != values->size() * values->size()) return {};
  const auto n = static_cast<Eigen::Index>(values->size());
  return OffsetFit{Eigen::VectorXd::Map(values->data(), n),
                   Eigen::MatrixXd::Map(covariance->data(), n, n)};
}

void RunCache::keep(const std::string& key, const Result<OffsetFit>& fit) {
  if (!fit) return add(key, {{"error", fit.error().message}});
  add(key, {{"values", flat(fit->values)}, {"covariance", flat(fit->covariance)}});
}

}  // namespace gapfarm
