#include <nlohmann/json.hpp>
#include <set>

#include "common/base/ranges.h"
#include "common/base/text.h"
#include "common/base/text_table.h"
#include "common/json/fields.h"
#include "common/json/json.h"
#include "common/math/rank_tests.h"
#include "master/experiments/blind_check/tally.h"

namespace gapfarm {
namespace {

// A rate as a row: label, wanted, share with interval, counts.
struct RateRow {
  std::string key;  // in JSON
  std::string label;
  std::string wanted;
  Rate rate;
  std::optional<std::string> level = {};  // of one of several rates of this key
};

// With what DIAGNOSIS asks of each.
std::vector<RateRow> rate_rows(const Tally& sum) {
  std::vector<RateRow> rows = {{"right", "all cases right", "", sum.right}};
  for (const auto& [level, rate] : sum.singles_right) {
    const std::string wanted = level == "clear" ? ">= 95 %" : level == "subtle" ? ">= 70 %" : "";
    rows.push_back({"singles_right", "single " + level + " effects: first or alias right", wanted,
                    rate, level});
  }
  for (const auto& [level, rate] : sum.singles_first) {
    rows.push_back(
        {"singles_first", "single " + level + " effects: the true name first", "", rate, level});
  }
  append(
      rows,
      std::vector<RateRow>{
          {"null_none", "nulls called none", ">= 95 %", sum.null_none},
          {"false_alarms", "nulls with an effect named (false alarms)", "", sum.false_alarms},
          {"outside_unknown", "effects outside the catalogue called unknown", ">= 85 %",
           sum.outside_unknown},
          {"outside_closed", "... of these, model.toml closes half of the truth's", ">= 79 %",
           sum.outside_closed},
          {"pairs_right", "pairs right", ">= 80 %", sum.pairs_right},
          {"missed_below", "missed effects that lie below what their log shows", "",
           sum.missed_below},
          {"covered", "parameters within their 90 % interval", "85 to 95 %", sum.covered},
          {"strengths_covered", "... of these, strengths", "", sum.strengths_covered},
          {"places_covered", "... of these, places, directions and the like", "",
           sum.places_covered},
          {"fits_covered", "... by the interval of the fit alone", "88 to 92 %", sum.fits_covered},
          {"fits_at_bound", "intervals of fits 0.9 to 1.3 times as wide as the bound", ">= 90 %",
           sum.fits_at_bound},
          {"promise_kept", "promised shrinkage within 0.1 of realised", ">= 90 %",
           sum.promise_kept},
          {"failed", "diagnoses that failed", "0", sum.failed}});
  return rows;
}

std::string percent(const Rate& rate) {
  if (rate.total == 0) return "-";
  const Interval i = wilson_interval(rate.hits, rate.total, 0.95);
  return formatted("%.0f %% [%.0f, %.0f]", 100 * rate.share(), 100 * i.lower, 100 * i.upper);
}

std::string counts(const Rate& rate) {
  return std::to_string(rate.hits) + "/" + std::to_string(rate.total);
}

std::string short_number(double value) { return formatted("%.4g", value); }

std::string share(const std::optional<double>& value) {
  return value ? formatted("%.2f", *value) : "-";
}

Json rate_json(const Rate& rate) {
  const Interval i = wilson_interval(rate.hits, rate.total, 0.95);
  Json json = {{"hits", rate.hits}, {"total", rate.total}};
  if (rate.total > 0) {
    json["share"] = rate.share();
    json["lo"] = i.lower;
    json["hi"] = i.upper;
  }
  return json;
}

Json rates_json(const std::map<std::string, Rate>& rates) {
  Json json = Json::object();
  for (const auto& [name, rate] : rates) json[name] = rate_json(rate);
  return json;
}

Json reported_json(const Diagnosis& diagnosis) {
  Json effects = mapped(diagnosis.effects, [&](const NamedEffect& e) -> Json {
    return {{"name", e.name}, {"aliases", e.aliases}};
  });
  return {{"verdict", verdict_name(diagnosis.verdict)}, {"effects", effects}};
}

Json case_json(const ScoredCase& c) {
  Json json = {{"case", c.truth.id},
               {"outcome", child_state_name(c.end.state)},
               {"wall_s", c.end.wall_s},
               {"cpu_s", c.end.cpu_s},
               {"said", c.reported ? reported_json(*c.reported) : Json()}};
  if (!c.end.text.empty()) json["outcome_text"] = c.end.text;
  if (!c.has_truth) return json;
  json["truth"] = parse_json(format_truth(c.truth));
  json["right"] = c.judgement.right;
  json["why"] = c.judgement.why;
  Json coverage = mapped(c.coverage, [&](const Coverage& p) -> Json {
    return {
        {"parameter", p.effect + "." + p.key}, {"truth", p.truth},    {"lo", p.lo}, {"hi", p.hi},
        {"strength", p.is_strength},           {"covered", p.covered}};
  });
  json["coverage"] = coverage;
  json["promised"] = number_or_null(c.promised);
  json["realised"] = number_or_null(c.realised);
  if (c.fresh) {
    json["fresh_scores"] = {{"unit", "nats/trial"},
                            {"tuned", c.fresh->tuned},
                            {"final", c.fresh->final_},
                            {"truth", c.fresh->truth}};
    if (c.fresh->corrected) json["fresh_scores"]["corrected"] = *c.fresh->corrected;
  }
  return json;
}

TextTable rates_table(const Tally& sum) {
  return {{"what", "wanted", "found [95 % interval]", "cases"},
          mapped(rate_rows(sum), [](const RateRow& row) -> TextTable::Row {
            return {row.label, row.wanted, percent(row.rate), counts(row.rate)};
          })};
}

// A line for each row, a column for each key that any of them has.
template <class Value, class Text>
TextTable pivot(const std::string& corner,
                const std::map<std::string, std::map<std::string, Value>>& rows,
                const std::string& missing, Text text) {
  std::set<std::string> keys;
  for (const auto& [name, row] : rows) {
    for (const auto& [key, value] : row) keys.insert(key);
  }
  TextTable table{{corner}};
  append(table.head, keys);
  for (const auto& [name, row] : rows) {
    table.rows.push_back({name});
    for (const std::string& key : keys) {
      const Value* value = find_in(row, key);
      table.rows.back().push_back(value ? text(*value) : missing);
    }
  }
  return table;
}

TextTable effects_table(const Tally& sum) {
  TextTable table = pivot("effect", sum.by_effect, "-", counts);
  for (std::size_t i = 1; i < table.head.size(); ++i) table.head[i] += ", right";
  table.head.push_back("parameters covered");
  for (TextTable::Row& row : table.rows) {
    Rate covered;
    for (const auto& [key, rate] : sum.covered_by_parameter) {
      if (!key.starts_with(row.front() + ".")) continue;
      covered.hits += rate.hits;
      covered.total += rate.total;
    }
    row.push_back(covered.total ? counts(covered) : "-");
  }
  return table;
}

std::string effects_text(const Truth& truth) {
  std::string text;
  for (const TrueEffect& effect : truth.effects) {
    text += (text.empty() ? "" : "; ") + effect.name;
    for (const auto& [key, value] : effect.parameters)
      text += " " + key + " " + short_number(value);
  }
  return text.empty() ? "none" : text;
}

std::string reported_text(const ScoredCase& c) {
  if (!c.reported) return c.end.text.empty() ? "no diagnosis" : c.end.text;
  std::string text = verdict_name(c.reported->verdict);
  for (const NamedEffect& e : c.reported->effects) {
    text += " " + e.name;
    if (!e.aliases.empty()) text += " (or " + joined(e.aliases) + ")";
  }
  return text;
}

TextTable cases_table(const std::vector<ScoredCase>& cases) {
  TextTable table{{"case", "kind", "level", "truth", "said", "right", "covered", "promised",
                   "realised", "s", "CPU s"}};
  for (const ScoredCase& c : cases) {
    Rate covered;
    for (const Coverage& p : c.coverage) covered.add(p.covered);
    table.rows.push_back(
        {c.truth.id, c.has_truth ? case_kind_name(c.truth.kind) : "-", c.truth.level,
         c.has_truth ? effects_text(c.truth) : "-", reported_text(c),
         !c.has_truth        ? "-"
         : c.judgement.right ? "yes"
                             : "NO",
         covered.total ? counts(covered) : "-", share(c.promised), share(c.realised),
         formatted("%.0f", c.end.wall_s), formatted("%.0f", c.end.cpu_s)});
  }
  return table;
}

}  // namespace

std::string format_blind_json(const BlindReport& report) {
  const Tally sum = tally(report.cases);
  Json provenance = Json::object();
  for (const auto& [label, value] : report.provenance) provenance[label] = value;
  Json by_effect = Json::object();
  for (const auto& [effect, rates] : sum.by_effect) by_effect[effect] = rates_json(rates);
  Json cases = mapped(report.cases, case_json);
  Json out_of_reach = mapped(report.out_of_reach, [&](const OutOfReach& o) -> Json {
    return {{"effect", o.effect}, {"level", o.level}, {"size", o.size}};
  });
  Json rates = {{"right", 0}, {"singles_right", Json::object()}, {"singles_first", Json::object()}};
  for (const RateRow& row : rate_rows(sum)) {
    (row.level ? rates[row.key][*row.level] : rates[row.key]) = rate_json(row.rate);
  }
  const Json json = {{"version", 1},
                     {"provenance", provenance},
                     {"rates", rates},
                     {"by_effect", by_effect},
                     {"covered_by_parameter", rates_json(sum.covered_by_parameter)},
                     {"confusion", sum.confusion},
                     {"out_of_reach", out_of_reach},
                     {"cases", cases}};
  return json_text(json, 1) + "\n";
}

std::string format_blind_markdown(const BlindReport& report) {
  const Tally sum = tally(report.cases);
  std::string text = "# Blind check\n\n";
  for (const auto& [label, value] : report.provenance) text += "- " + label + ": `" + value + "`\n";
  text += "\n## Rates\n\n" + rates_table(sum).markdown();
  text += "\n## Single effects\n\n" + effects_table(sum).markdown();
  text += "\n## Confusion\n\nTrue family against what was reported first.\n\n" +
          pivot("truth \\ reported first", sum.confusion, "", [](unsigned count) {
            return std::to_string(count);
          }).markdown();
  if (!report.out_of_reach.empty()) {
    const TextTable table{{"effect", "level", "greatest size"},
                          mapped(report.out_of_reach, [](const OutOfReach& o) -> TextTable::Row {
                            return {o.effect, o.level, short_number(o.size)};
                          })};
    text +=
        "\n## Out of reach\n\nNo strength within the catalogue's bounds is as large as wanted "
        "on this experiment; these cases were not made.\n\n" +
        table.markdown();
  }
  return text + "\n## Cases\n\n" + cases_table(report.cases).markdown();
}

std::string format_blind_summary(const BlindReport& report) {
  TextTable rates = rates_table(tally(report.cases));
  std::erase_if(rates.rows, [](const TextTable::Row& row) { return row.back() == "0/0"; });
  std::string text = rates.text("<<>>");
  for (const ScoredCase& c : report.cases) {
    if (c.has_truth && c.judgement.right) continue;
    text += (c.has_truth ? "WRONG " : "      ") + c.truth.id + ": " +
            (c.has_truth ? c.judgement.why : reported_text(c)) + "\n";
  }
  return text;
}

}  // namespace gapfarm
