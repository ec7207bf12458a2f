#include "tools/eval/evaluation_report.hpp"

#include "tools/eval/report_text.hpp"

#include <nlohmann/json.hpp>

#include <cmath>
#include <sstream>

namespace lbea::tool {
namespace {

using Json = nlohmann::ordered_json;

Json or_null(double value) { return std::isnan(value) ? Json(nullptr) : Json(value); }

const char* mode_name(ReferenceMode mode) { return mode == ReferenceMode::impact ? "impact" : "over-time"; }

Json to_json(const Score& score) {
  Json json{{"mean", or_null(score.mean)}, {"median", or_null(score.median)}, {"ratio", or_null(score.ratio)}};
  if (!std::isnan(score.exact)) json["own_sample"] = score.exact;
  return json;
}

Json to_json(const Round& round) {
  const Summary summary = summarise(round.tests);
  Json json{{"experiments", round.title}, {"mode", mode_name(round.mode)}, {"frames_are", round.disturbance.name},
            {"tests", summary.tests},     {"frames", summary.frames},      {"oracle", to_json(summary.oracle)}};
  for (std::size_t c = 0; c < contenders; ++c)
    if (!std::isnan(summary.scores[c].mean))
      json["methods"][std::string(contender_names[c])] = to_json(summary.scores[c]);
  for (std::size_t v = 0; v < summary.verdicts.size(); ++v)
    json["verdicts"][std::string(to_string(static_cast<Verdict>(v)))] = summary.verdicts[v];
  for (std::size_t v = 0; v < summary.test_verdicts.size(); ++v)
    json["test_verdicts"][std::string(to_string(static_cast<Verdict>(v)))] = or_null(summary.test_verdicts[v]);
  json["own_simulation"] = or_null(summary.named);
  json["field"] = {{"true_mean", or_null(summary.field.true_mean)},
                   {"matched", or_null(summary.field.matched)},
                   {"inferred", or_null(summary.field.inferred)},
                   {"hidden", or_null(summary.field.hidden)},
                   {"within_two_spreads", or_null(summary.field.within_spread)}};
  for (const TestTrial& test : round.tests) {
    const Summary alone = summarise(std::span(&test, 1));
    Json line{{"experiment", test.experiment},
              {"branch", test.branch},
              {"named", test.named},
              {"oracle", or_null(alone.oracle.mean)}};
    for (std::size_t c = 0; c < contenders; ++c) line[std::string(contender_names[c])] = or_null(alone.scores[c].mean);
    json["tests_alone"].push_back(std::move(line));
  }
  return json;
}

std::string quoted(std::string_view text) {
  if (text.find_first_of(",\"\n") == std::string_view::npos) return std::string(text);
  std::string result = "\"";
  for (const char c : text) result += c == '"' ? std::string("\"\"") : std::string(1, c);
  return result + '"';
}

struct Cells {
  std::ostringstream out;
  void text(std::string_view value) { out << quoted(value) << ','; }
  template <class T>
  void number(T value) {
    if constexpr (std::is_floating_point_v<T>) {
      if (std::isfinite(value)) out << value;
    } else {
      out << value;
    }
    out << ',';
  }
  void end() {
    out.seekp(-1, std::ios::cur);
    out << '\n';
  }
};

std::string frames_csv(const Evaluation& evaluation) {
  Cells cells;
  cells.out
      << "experiments,mode,frames_are,experiment,branch,step,time_s,points,status,verdict,test_verdict,coverage,oracle";
  for (const auto name : contender_names) cells.out << ',' << name;
  cells.out << ",fit_is_own,residual,estimate_residual,misfit,spread,tracked_probability,branch_probability,field_true,"
               "field_matched,field_inferred,x1,x2,x3\n";
  for (const Round& round : evaluation.rounds)
    for (const TestTrial& test : round.tests)
      for (const FrameTrial& frame : test.frames) {
        cells.text(round.title), cells.text(mode_name(round.mode)), cells.text(round.disturbance.name),
            cells.text(test.experiment);
        cells.number(test.branch), cells.number(frame.step), cells.number(frame.time_s), cells.number(frame.points);
        cells.text(to_string(frame.status)), cells.text(to_string(frame.verdict)),
            cells.text(to_string(frame.test_verdict)), cells.number(frame.coverage), cells.number(frame.best.error);
        for (const double error : frame.errors) cells.number(error);
        cells.number(test.contained && frame.samples[static_cast<std::size_t>(Contender::fit)] == frame.own ? 1 : 0);
        cells.number(frame.fit.residual), cells.number(frame.fit.estimate_residual), cells.number(frame.fit.misfit),
            cells.number(frame.fit.spread);
        cells.number(frame.simulation_probability), cells.number(frame.branch_probability);
        cells.number(frame.field.true_mean), cells.number(frame.field.matched), cells.number(frame.field.inferred);
        for (const float x : frame.leading_coordinates) cells.number(x);
        cells.end();
      }
  return cells.out.str();
}

std::string view_csv(const Evaluation& evaluation) {
  Cells cells;
  cells.out << "kind,name,branch,step,time_s,x1,x2,x3";
  for (const std::string& name : evaluation.parameter_names) cells.out << ',' << quoted(name);
  cells.out << '\n';
  for (const ViewPoint& point : evaluation.view) {
    cells.text("simulation"), cells.text(point.simulation), cells.number(point.branch), cells.number(point.time_step),
        cells.number(point.time_s);
    for (const float x : point.coordinates) cells.number(x);
    for (const double value : point.parameters) cells.number(value);
    cells.end();
  }
  const std::vector<TestTrial> none;
  for (const TestTrial& test : evaluation.rounds.empty() ? none : evaluation.rounds.front().tests)
    for (const FrameTrial& frame : test.frames) {
      cells.text("experiment"), cells.text(test.experiment), cells.number(test.branch), cells.number(frame.step),
          cells.number(frame.time_s);
      for (const float x : frame.leading_coordinates) cells.number(x);
      for (std::size_t i = 0; i < evaluation.parameter_names.size(); ++i) cells.out << ',';
      cells.end();
    }
  return cells.out.str();
}

}  // namespace

std::string to_json(const Evaluation& evaluation) {
  Json json{{"complete", evaluation.complete},
            {"length_unit", evaluation.length_unit},
            {"field", evaluation.field},
            {"branches", evaluation.branches}};
  for (const bake::BakeSummary& bake : evaluation.bakes)
    json["bakes"].push_back({{"samples", bake.samples},
                             {"simulations", bake.simulations},
                             {"vertices", bake.vertices},
                             {"references", bake.references},
                             {"seconds",
                              {{"reading", bake.seconds.reading},
                               {"bases", bake.seconds.bases},
                               {"samples", bake.seconds.samples},
                               {"writing", bake.seconds.writing}}}});
  for (const Round& round : evaluation.rounds) json["rounds"].push_back(to_json(round));
  return json.dump(2, ' ', false, Json::error_handler_t::replace);
}

void write_evaluation(const std::filesystem::path& folder, const Evaluation& evaluation) {
  const std::string text = tables(evaluation);
  write_text(folder / "tables.md", text.empty() ? "Nothing was measured.\n" : text);
  write_text(folder / "summary.json", to_json(evaluation) + '\n');
  write_text(folder / "frames.csv", frames_csv(evaluation));
  write_text(folder / "view.csv", view_csv(evaluation));
}

}  // namespace lbea::tool
