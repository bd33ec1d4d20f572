#include "master/ground/fit/fit_file.h"

#include <nlohmann/json.hpp>
#include <utility>

namespace gapfarm {
namespace {

// Values first, then three scales a horizon.
std::optional<KeptFit> fit_of(const nlohmann::json& line) {
  if (!line.is_object() || !line.contains("values") || !line.contains("scales")) return {};
  KeptFit fit;
  const auto& values = line["values"];
  const auto& scales = line["scales"];
  if (!values.is_array() || !scales.is_array() || scales.size() % 3 != 0) return {};
  const auto number = [](const nlohmann::json& n) { return n.is_number() ? n.get<double>() : 0; };
  fit.values.resize(static_cast<Eigen::Index>(values.size()));
  for (std::size_t i = 0; i < values.size(); ++i) {
    fit.values[static_cast<Eigen::Index>(i)] = number(values[i]);
  }
  for (std::size_t i = 0; i < scales.size(); i += 3) {
    fit.scales.emplace_back(number(scales[i]), number(scales[i + 1]), number(scales[i + 2]));
  }
  return fit;
}

}  // namespace

FitFile::FitFile(std::filesystem::path file) : file_(std::move(file)) {
  std::ifstream from(file_);
  for (std::string line; std::getline(from, line);) {
    const auto json = nlohmann::json::parse(line, nullptr, false);
    const auto fit = fit_of(json);
    if (fit && json.contains("key") && json["key"].is_string()) {
      fits_[json["key"].get<std::string>()] = *fit;
    }
  }
  from.close();
  to_.open(file_, std::ios::app);
  to_ << "\n";  // whatever broke off is over
}

std::optional<KeptFit> FitFile::find(const std::string& key) {
  const auto found = fits_.find(key);
  if (found == fits_.end()) return std::nullopt;
  return found->second;
}

void FitFile::keep(const std::string& key, const KeptFit& fit) {
  nlohmann::json values = nlohmann::json::array(), scales = nlohmann::json::array();
  for (const double value : fit.values) values.push_back(value);
  for (const Eigen::Vector3d& s : fit.scales) {
    for (const double scale : s) scales.push_back(scale);
  }
  to_ << nlohmann::json{{"key", key}, {"values", values}, {"scales", scales}}.dump() << "\n";
  to_.flush();
}

void FitFile::remove() {
  to_.close();
  std::error_code ignored;
  std::filesystem::remove(file_, ignored);
}

}  // namespace gapfarm
