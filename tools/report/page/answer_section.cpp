// The verdict with what it rests on, flaws of the recording, warnings, and the other tests.
#include "tools/report/page/html.hpp"
#include "tools/report/page/page.hpp"

#include <cmath>

namespace lbea::tool {
namespace {

constexpr std::size_t most_flaws = 12;

std::string warnings_of(const TestReport& report) {
  if (report.warnings.empty()) return "";
  std::string text = "<section aria-label=\"Warnings\"><h2>Warnings</h2>\n<ul>";
  for (const std::string& warning : report.warnings) text += "<li>" + escaped(warning) + "</li>";
  return text + "</ul></section>\n";
}

class Facts {
 public:
  /// name: markup; `value` and `remark` are any texts.
  void add(const std::string& name, const std::string& value, const std::string& remark = "") {
    list_ += "<div><dt>" + name + "</dt><dd>" + escaped(value) +
             (remark.empty() ? "" : "<small>" + escaped(remark) + "</small>") + "</dd></div>\n";
  }
  [[nodiscard]] std::string html() const { return list_.empty() ? "" : "<dl class=\"facts\">\n" + list_ + "</dl>\n"; }

 private:
  std::string list_;
};

void add_fit(Facts& facts, const TestReport& report) {
  const wire::WireTestState& state = report.state();
  if (state.frames == 0) return;
  const bool fits = state.verdict != wire::WireVerdict::no_simulation_fits;
  facts.add("Does a simulation fit?", report.explanation.answer,
            "misfit " + number_text(double{state.misfit}) + "; 1 is expected" +
                (std::isfinite(report.test_limit) ? ", " + number_text(report.test_limit) + " is the limit" : ""));
  if (!fits || state.simulations.empty())
    return facts.add("Which one is nearest?", simulation_name(report.names, state.simulation), "by all frames");
  const auto chance = [&](std::size_t i) {
    return simulation_name(report.names, state.simulations[i].simulation) + ", " +
           percent_text(double{state.simulations[i].probability});
  };
  facts.add("Which one, and how sure?", chance(0),
            "by all frames" + (state.simulations.size() > 1 ? "; next " + chance(1) : ""));
}

void add_end(Facts& facts, const TestReport& report) {
  const wire::WireResult& last = *report.record()->latest();
  const Likeliest branch = likeliest_branch(report.state());
  const bool has_branch = branch.branches > 1 && report.state().verdict != wire::WireVerdict::no_simulation_fits;
  std::string nearest;
  if (!last.matches.empty())
    nearest = simulation_name(report.names, last.matches.front().sample.simulation) + " at " +
              time_text(last.matches.front().time_s) + " of its time";
  if (has_branch)
    facts.add("How did it end?", "branch " + std::to_string(branch.branch),
              "of " + std::to_string(branch.branches) + " branches, " + percent_text(branch.branch_probability) +
                  " probable" + (nearest.empty() ? "" : "; the last frame alone is most like " + nearest));
  else if (!nearest.empty())
    facts.add("How did it end?", "like " + nearest, "by the last frame alone");
  if (std::isfinite(last.fit.error_90))
    facts.add("How exact is the final shape?",
              "within " + number_text(double{last.fit.error_90}) + " " + report.length_unit(),
              "mean error of the estimate for the last frame, in 90 % of tests like the ensemble's");
}

/// What the shapes tell about the test's parameters, and of how many they tell nothing.
void add_parameters(Facts& facts, const TestReport& report) {
  if (report.parameters() == 0 || report.state().verdict == wire::WireVerdict::no_simulation_fits) return;
  std::size_t unknown = 0;
  for (std::uint32_t p = 0; p < report.parameters(); ++p) {
    const ParameterForecast& forecast = report.forecast().parameters[p];
    if (forecast.is_identifiable())
      facts.add("Parameter " + escaped(report.model.parameter_name(p)),
                interval_text(double{forecast.value}, double{forecast.bound_90}),
                "90 % interval; simulations: " + range_text(report.model, p));
    else
      ++unknown;
  }
  if (unknown > 0)
    facts.add("Parameters not identifiable", std::to_string(unknown) + " of " + std::to_string(report.parameters()),
              "the shape does not tell them; see the table of parameters");
}

void add_account(Facts& facts, const TestReport& report) {
  const TestRecord& record = *report.record();
  const wire::WireResult& last = *record.latest();
  facts.add("How long was it seen?", time_text(record.seconds()),
            std::isfinite(last.fit.test_time) ? "until " + time_text(double{last.fit.test_time}) + " after the impact"
                                              : "first to last matched frame");
  const wire::Counters& counters = report.accounts.counters;
  facts.add("Frames matched",
            std::to_string(counters.sum(wire::Fate::matched)) + " of " + std::to_string(counters.captured()),
            std::to_string(counters.sum(wire::Fate::rejected)) + " rejected, " +
                std::to_string(counters.sum(wire::Fate::dropped)) + " dropped");
}

const char* class_of(Explanation::Tone tone) {
  return tone == Explanation::Tone::good ? "good" : tone == Explanation::Tone::bad ? "bad" : "open";
}

std::string box_of(const Explanation& answer, const std::string& label) {
  return std::string("<section class=\"answer ") + class_of(answer.tone) + "\" aria-label=\"" + label +
         "\"><p class=\"word\">" + escaped(answer.word) + "</p>\n<p class=\"headline\">" + escaped(answer.headline) +
         "</p>\n<p><strong>What it means:</strong> " + escaped(answer.meaning) +
         "</p>\n<p><strong>What to do:</strong> " + escaped(answer.action) + "</p></section>\n";
}

}  // namespace

/// Before everything else: what a damaged or incomplete recording cannot tell.
std::string flaws_section(const TestReport& report) {
  const std::vector<std::string> flaws = report.content.audit.flaws();
  if (flaws.empty()) return "";
  std::string text = "<section class=\"flaws\" aria-label=\"The recording\"><p><strong>The recording is ";
  text += report.content.audit.file.is_intact() ? "not complete." : "damaged: this report shows what could be read.";
  text += "</strong></p>\n<ul>";
  for (std::size_t i = 0; i < std::min(flaws.size(), most_flaws); ++i) text += "<li>" + escaped(flaws[i]) + "</li>";
  if (flaws.size() > most_flaws) text += "<li>and " + std::to_string(flaws.size() - most_flaws) + " more</li>";
  return text + "</ul></section>\n";
}

std::string joint_section(std::span<const TestReport> components) {
  std::string html = box_of(explain_together(components), "Verdict of the test") +
                     "<section aria-label=\"Components\"><table><thead><tr><th scope=\"col\">Component</th>"
                     "<th scope=\"col\">Verdict</th>" +
                     number_head("Frames") + "</tr></thead>\n<tbody>";
  for (const TestReport& report : components)
    html += "<tr><td>" + escaped(report.component) + "</td><td>" + escaped(answer_text(report.state(), report.names)) +
            "</td>" +
            number_cell(std::to_string(report.record() == nullptr ? 0 : report.record()->answer().matched())) +
            "</tr>\n";
  return html + "</tbody></table></section>\n";
}

std::string answer_section(const TestReport& report) {
  Facts facts;
  add_fit(facts, report);
  if (report.record() != nullptr) {
    add_end(facts, report);
    add_parameters(facts, report);
    add_account(facts, report);
  }
  return box_of(report.explanation, "Verdict") + facts.html() + warnings_of(report);
}

std::string tests_section(const TestReport& report) {
  const RecordingContent& content = report.content;
  if (content.tests.size() < 2) return "";
  std::string text = "<section aria-label=\"Tests\"><h2>Tests in this recording</h2>\n<p>This report is about test " +
                     std::to_string(*report.test + 1) +
                     "; <code>--test N</code> reports another one.</p>\n"
                     "<table><thead><tr><th scope=\"col\" class=\"number\">Test</th><th scope=\"col\">Sender</th>"
                     "<th scope=\"col\" class=\"number\">Frames</th><th scope=\"col\" "
                     "class=\"number\">Duration</th><th scope=\"col\">Verdict</th></tr></thead>\n<tbody>";
  for (std::size_t i = 0; i < content.tests.size(); ++i) {
    const TestRecord& record = content.tests[i].record;
    text += "<tr>" + number_cell(std::to_string(i + 1)) + "<td>" + hexadecimal_text(content.tests[i].key.first) +
            "</td>" + number_cell(std::to_string(record.answer().matched())) +
            number_cell(time_text(record.seconds())) + "<td>" +
            escaped(answer_text(record.answer().state(), report.names)) + "</td></tr>\n";
  }
  text += "</tbody></table>\n";
  if (content.omitted_tests > 0)
    text += "<p>" + std::to_string(content.omitted_tests) + " frames of further tests are not shown.</p>\n";
  return text + "</section>\n";
}

}  // namespace lbea::tool
