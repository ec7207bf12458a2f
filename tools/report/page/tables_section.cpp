// The likeliest simulations with their parameters; what became of every frame.
#include "tools/report/page/html.hpp"
#include "tools/report/page/page.hpp"

#include "adapters/wire/codec/codec.hpp"

#include <algorithm>
#include <cmath>

namespace lbea::tool {
namespace {

constexpr std::size_t most_listed = 5;

std::string parameter_cells(const Model& model, std::uint32_t simulation) {
  std::string cells;
  for (std::uint32_t p = 0; p < model.parameters(); ++p)
    cells += number_cell(simulation < model.simulations() ? number_text(model.parameter(simulation, p), 4)
                                                          : number_text(NAN));
  return cells;
}

class AccountTable {
 public:
  /// `remark`: any text.
  void add(const std::string& name, std::uint64_t count, std::string_view remark = "", bool is_reason = false) {
    rows_ += std::string("<tr") + (is_reason ? " class=\"sub\"" : "") + "><td>" + escaped(name) + "</td>" +
             number_cell(std::to_string(count)) + "<td>" + escaped(remark) + "</td></tr>\n";
  }
  void add(std::span<const Accounts::Reason> reasons) {
    for (const auto& [status, count] : reasons)
      add(std::string(wire::to_string(status)), count, wire::explain(status), true);
  }
  [[nodiscard]] std::string html() const {
    return "<table><thead><tr><th scope=\"col\">Frames</th>" + number_head("Number") +
           "<th scope=\"col\">Meaning</th></tr></thead>\n<tbody>" + rows_ + "</tbody></table>\n";
  }

 private:
  std::string rows_;
};

std::string verdict_counts(const TestRecord& record) {
  std::string text;
  for (const auto& [verdict, count] : record.verdicts())
    text += (text.empty() ? "" : ", ") + std::to_string(count) + " " + std::string(wire::to_string(verdict));
  return text;
}

}  // namespace

std::string simulations_section(const TestReport& report) {
  const wire::WireTestState& state = report.state();
  if (state.simulations.empty()) return "";
  std::string html = "<section aria-label=\"Simulations\"><h2>Likeliest simulations</h2>\n";
  if (state.verdict == wire::WireVerdict::no_simulation_fits)
    html += "<p>No simulation fits: the probabilities only compare simulations with each other.</p>\n";
  html += "<div class=\"scroll\" tabindex=\"0\"><table><thead><tr><th scope=\"col\">Simulation</th>" +
          number_head("Probability") + number_head("Branch");
  for (std::uint32_t p = 0; p < report.model.parameters(); ++p)
    html += number_head(escaped(report.model.parameter_name(p)));
  html += "</tr></thead>\n<tbody>";
  for (std::size_t i = 0; i < std::min(most_listed, state.simulations.size()); ++i) {
    const auto& [simulation, probability] = state.simulations[i];
    html +=
        "<tr><td>" + escaped(simulation_name(report.names, simulation)) + "</td>" +
        number_cell(percent_text(double{probability})) +
        number_cell(simulation < report.model.simulations() ? std::to_string(report.model.branch_of(simulation)) : "") +
        parameter_cells(report.model, simulation) + "</tr>\n";
  }
  return html + "</tbody></table></div></section>\n";
}

std::string accounts_section(std::span<const TestReport> reports) {
  const TestReport& report = reports.front();
  const wire::Counters& counters = report.accounts.counters;
  const RunAudit& audit = report.content.audit;
  AccountTable table;
  table.add("captured", counters.captured(), "by the senders' ids and messages");
  table.add("received", counters.received, "arrived at the matcher");
  table.add("matched", counters.sum(wire::Fate::matched));
  table.add("rejected", counters.sum(wire::Fate::rejected));
  table.add(report.accounts.rejected);
  table.add("dropped", counters.sum(wire::Fate::dropped));
  table.add(report.accounts.dropped);
  if (!counters.adds_up())
    table.add("without a result", counters.on_the_way(), "received, and not yet matched at the end of the recording");
  std::string html =
      "<section class=\"page\" aria-label=\"Accounts\"><h2>What became of every frame</h2>\n<p>captured = matched + "
      "rejected + dropped, " +
      std::string(report.accounts.is_by_matcher ? "by the matcher's last counters, for the whole recording."
                                                : "counted in the recording.") +
      "</p>\n" + table.html();
  html +=
      "<p>In the recording: " + std::to_string(audit.frames) + " frames, " + std::to_string(audit.results) + " results";
  if (audit.frames > 0)
    html += ", received within " + number_text(static_cast<double>(audit.end_ns - audit.start_ns) * 1e-9) + " s";
  if (audit.missing() > 0) html += "; " + std::to_string(audit.missing()) + " captures are missing";
  if (audit.unanswered > 0) html += "; " + std::to_string(audit.unanswered) + " frames have no result";
  html += ".</p>\n";
  for (const TestReport& of : reports)
    if (of.record() != nullptr)
      html += "<p>Verdicts of the frames of this test" + (reports.size() > 1 ? ", " + escaped(of.component) : "") +
              ": " + escaped(verdict_counts(*of.record())) + ".</p>\n";
  return html + "</section>\n";
}

}  // namespace lbea::tool
