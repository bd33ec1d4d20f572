#include "master/report/report_html.h"

#include <nlohmann/json.hpp>

#include "master/diagnose/result/diagnosis_json.h"
#include "master/report/gap_split.h"
#include "master/report/glossary.h"
#include "master/report/html.h"
#include "master/report/page_frame.h"
#include "master/report/parameters_section.h"
#include "master/report/report_sections.h"

namespace gapfarm {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kDrivenEnds =
    R"(One picture a command, seen from where each trial began; turns on the spot by their headings, a row a condition. An ellipse or a bar should hold nine trials in ten. As driven, there is one a condition, so a model that looks at more than the command spreads its predictions; an error takes each trial's own prediction away.)";
constexpr const char* kDrivenResiduals =
    R"(Measured minus predicted, along the axes of the predicted end pose.)";

std::string or_else(const std::string& label, const char* driven) {
  return label.empty() ? driven : html_escaped(label);
}

std::string poses_section(const Diagnosis& diagnosis) {
  return R"(<section id="poses"><h2>Measured against predicted end poses</h2>
<p>)" + or_else(diagnosis.labels.ends, kDrivenEnds) +
         "</p>" +
         plot_key(measured_key() + model_keys("tuned base model", "final model, with effects")) +
         R"(<div class="controls" id="pose-controls"></div>
<div class="grid" id="pose-plots"></div>)" +
         kNoScript + "</section>\n";
}

std::string residuals_section(const Diagnosis& diagnosis) {
  std::string html = R"(<section id="residuals"><h2>Where the )" + term("tuned", "tuned model") +
                     " goes wrong</h2>";
  if (diagnosis.where.empty()) {
    html += "<p>Its residuals depend on nothing that was looked at.</p>";
  } else {
    html += where_table(diagnosis.where, "Where the tuned model goes wrong", "where");
  }
  return html + R"(<h3 id="residual-title">)" + term("residual", "Residuals") +
         R"( against what may drive them</h3>
<p>)" + or_else(diagnosis.labels.residuals, kDrivenResiduals) +
         R"( Lines join the means of neighbouring trials, with 90 % intervals.</p>)" +
         plot_key(model_keys("tuned base model", "final model, with effects")) +
         R"(<div class="controls" id="residual-controls"></div>
<div class="grid" id="residual-plots"></div>)" +
         kNoScript + "</section>\n";
}

std::string unexplained_section(const Diagnosis& diagnosis) {
  std::string html = R"(<section id="unexplained"><h2>What stays unexplained</h2>)";
  if (diagnosis.unexplained.empty()) {
    return html +
           "<p>The final model's residuals depend on nothing that was looked at.</p></section>\n";
  }
  return html + where_table(diagnosis.unexplained, "What stays unexplained", "unexplained") +
         "</section>\n";
}

std::string shape_section(const Diagnosis& diagnosis) {
  if (!diagnosis.residual && diagnosis.nearest.empty()) return "";
  std::string html = R"(<section id="shape"><h2>The shape of what nothing explains</h2>)";
  if (diagnosis.residual) html += "<p>" + html_escaped(diagnosis.residual->text) + "</p>";
  if (diagnosis.residual && !diagnosis.residual->correction.field.empty()) {
    html +=
        R"(<div class="controls" id="shape-controls"></div><div class="grid" id="shape-plots"></div>)";
    html += kNoScript;
  }
  if (diagnosis.residual && diagnosis.residual->correction.outliers) {
    html += R"(<div class="grid" id="stray-plots"></div>)";
    html += kNoScript;
  }
  if (!diagnosis.nearest.empty()) {
    html += "<h3>What comes nearest, and why it is not the cause</h3><ul>";
    for (const NearMiss& miss : diagnosis.nearest) {
      html += "<li>" + html_escaped(miss.text) + "</li>";
    }
    html += "</ul>";
  }
  return html + "</section>\n";
}

}  // namespace

std::string report_html(const Diagnosis& diagnosis, bool served) {
  PageFrame frame;
  frame.title = diagnosis.headline.empty() ? "gapfarm diagnosis" : diagnosis.headline;
  frame.brand = "diagnosis";
  frame.served = served;
  const bool driven = diagnosis.labels.ends.empty();
  Json page = summary_json(diagnosis);
  page["drives"] = drives_json(diagnosis.drives);
  page["models"] = {{"tuned", "tuned"}, {"final", "final"}};
  page["served"] = served;
  page["without_trials"] = "This diagnosis was kept without its trials.";
  const Json trials = trials_json(diagnosis, kPlotDigits);
  if (diagnosis.verdict == Verdict::kUnusable) {
    // Nothing was simulated: there is nothing to plot.
    frame.places = {{"sanity", "Doubts"}, {"provenance", "Inputs"}};
    frame.body = summary_section(diagnosis) + sanity_section(diagnosis) +
                 cautions_section(diagnosis) + provenance_section(diagnosis);
    return framed_page(frame, page, trials);
  }
  frame.places = {{"gap", "Gap"},
                  {"parameters", "Parameters"},
                  {"poses", "Poses"},
                  {"residuals", "Residuals"},
                  {"screening", "Catalogue"},
                  {"shrinkage", "Shrinkage"},
                  {"next", "Next"},
                  {"provenance", "Inputs"},
                  {"words", "Words"}};
  if (driven) {
    frame.places.insert(frame.places.begin() + 2, {{"floor", "Floor"}, {"drives", "Drives"}});
  }
  std::string& body = frame.body;
  body = summary_section(diagnosis) + sanity_section(diagnosis);
  body += R"(<section id="gap"><h2>The )" + term("gap", "gap") + ", split by cause</h2>" +
          gap_split_html(diagnosis) + "</section>\n";
  body +=
      parameters_section(diagnosis.parameters, diagnosis.correlations,
                         {{"tuned", "tuned"}, {"final", "final"}, {"interval", "90 % interval"}});
  if (driven) body += floor_section() + drives_section("tuned model", "final model");
  body += poses_section(diagnosis);
  body += residuals_section(diagnosis);
  body += screening_section(diagnosis);
  body += shrinkage_section(diagnosis);
  body += unexplained_section(diagnosis);
  const std::string shape = shape_section(diagnosis);
  if (!shape.empty()) frame.places.insert(frame.places.end() - 3, {"shape", "Shape"});
  body += shape;
  body += next_section(diagnosis);
  body += cautions_section(diagnosis);
  body += provenance_section(diagnosis);
  body += glossary_section(diagnosis_terms());
  return framed_page(frame, page, trials);
}

}  // namespace gapfarm
