#include "tools/eval/evaluation_report.hpp"

#include "adapters/files/atomic_file.hpp"
#include "tools/shared/text/channel_column.hpp"
#include "tools/shared/text/csv_table.hpp"

#include <nlohmann/json.hpp>

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
  const Summary summary = summarize(round.tests);
  Json json{{"experiments", round.title}, {"mode", mode_name(round.mode)}, {"frames_are", round.disturbance.name},
            {"tests", summary.tests},     {"frames", summary.frames},      {"oracle", to_json(summary.oracle)}};
  for (std::size_t c = 0; c < evaluated_methods; ++c)
    if (!std::isnan(summary.scores[c].mean))
      json["methods"][std::string(evaluated_method_names[c])] = to_json(summary.scores[c]);
  for (std::size_t v = 0; v < summary.verdicts.size(); ++v)
    json["verdicts"][std::string(to_string(static_cast<Verdict>(v)))] = summary.verdicts[v];
  for (std::size_t v = 0; v < summary.test_verdicts.size(); ++v)
    json["test_verdicts"][std::string(to_string(static_cast<Verdict>(v)))] = or_null(summary.test_verdicts[v]);
  json["own_simulation"] = or_null(summary.named);
  for (const auto& [name, value] : field_errors) json["field"][name] = or_null(summary.field.*value);
  for (std::size_t b = 0; b < bounded_names.size(); ++b)
    json["bounds_90"][std::string(bounded_names[b])] = {{"within", or_null(summary.bounds[b].within)},
                                                        {"mean", or_null(summary.bounds[b].mean)}};
  for (const FoldRow& fold : fold_rows(round.tests)) {
    Json& line = json["folds"][fold.name] = {{"tests", fold.tests}, {"oracle", or_null(fold.values[0])}};
    for (std::size_t c = 0; c < tabulated_methods.size(); ++c)
      line[std::string(evaluated_method_names[static_cast<std::size_t>(tabulated_methods[c])])] =
          or_null(fold.values[c + 1]);
  }
  for (const TestTrial& test : round.tests) {
    const Summary alone = summarize(std::span(&test, 1));
    Json line{{"experiment", test.experiment},
              {"branch", test.branch},
              {"fold", test.fold},
              {"named", test.named},
              {"oracle", or_null(alone.oracle.mean)}};
    for (std::size_t c = 0; c < evaluated_methods; ++c)
      line[std::string(evaluated_method_names[c])] = or_null(alone.scores[c].mean);
    json["tests_alone"].push_back(std::move(line));
  }
  return json;
}

std::vector<std::string> channel_heads(const Evaluation& evaluation) {
  std::vector<std::string> heads;
  for (std::uint32_t c = 0; evaluation.model && c < evaluation.model->channels(); ++c)
    for (const char* kind : {"true", "", "bound_90"}) {
      const ChannelInfo info = evaluation.model->channel(c);
      heads.push_back(channel_column(std::string(info.name), kind, std::string(info.unit)));
    }
  return heads;
}

void add_channels(CsvTable& table, const FrameTrial& frame, std::size_t columns) {
  for (const ChannelScore& score : frame.channels) table.add(score.truth, score.value, score.bound_90);
  for (std::size_t c = 3 * frame.channels.size(); c < columns; ++c) table.add("");
}

std::string frames_csv(const Evaluation& evaluation) {
  CsvTable table("experiments,mode,frames_are,experiment,branch,fold,step,time_s,points,status,verdict,test_verdict");
  for (const auto& number : frame_numbers) table.add(number.name);
  table.add("oracle");
  for (const auto name : evaluated_method_names) table.add(name);
  table.add("fit_is_own");
  for (const auto& number : fit_numbers) table.add(number.name);
  table.add("pose_left_deg", "pose_left", "clock_left_ms", "tracked_probability", "branch_probability", "field_true",
            "field_matched", "field_inferred");
  for (const auto name : bounded_names) table.add(std::string(name) + "_within_90", std::string(name) + "_bound_90");
  table.add("x1", "x2", "x3");
  const std::vector<std::string> channels = channel_heads(evaluation);
  for (const std::string& head : channels) table.add(head);
  table.end_row();
  for (const Round& round : evaluation.rounds)
    for (const TestTrial& test : round.tests)
      for (const FrameTrial& frame : test.frames) {
        table.add(round.title, mode_name(round.mode), round.disturbance.name, test.experiment, test.branch, test.fold,
                  frame.step, frame.time_s, frame.points, to_string(frame.status), to_string(frame.verdict),
                  to_string(frame.test_verdict));
        for (const auto& number : frame_numbers) table.add(frame.*number.value);
        table.add(frame.best.error);
        for (const double error : frame.errors) table.add(error);
        table.add(test.contained && frame.samples[static_cast<std::size_t>(EvaluatedMethod::fit)] == frame.own ? 1 : 0);
        for (const auto& number : fit_numbers) table.add(frame.fit.*number.value);
        table.add(frame.pose_deg, frame.pose_error, frame.clock_error_ms, frame.simulation_probability,
                  frame.branch_probability, frame.field.true_mean, frame.field.matched, frame.field.inferred);
        for (const BoundCheck& check : frame.bounds) table.add(check.within, check.mean);
        for (const float x : frame.leading_coordinates) table.add(x);
        add_channels(table, frame, channels.size());
        table.end_row();
      }
  return table.text();
}

/// Of the reference that is used for a frame at the time of the sample.
std::array<float, 3> leading_coordinates(const Model& model, std::uint32_t sample) {
  const auto apart = [&](std::uint32_t r) { return std::abs(model.reference_time_s(r) - model.sample_time_s(sample)); };
  std::uint32_t nearest = 0;
  for (std::uint32_t r = 1; r < model.references(); ++r)
    if (apart(r) < apart(nearest)) nearest = r;
  return model.leading_coordinates(nearest, sample);
}

std::string view_csv(const Evaluation& evaluation) {
  CsvTable table("kind,name,branch,step,time_s,x1,x2,x3");
  const std::uint32_t parameters = evaluation.model ? evaluation.model->parameters() : 0;
  for (std::uint32_t p = 0; p < parameters; ++p) table.add(evaluation.model->parameter_name(p));
  table.end_row();
  for (std::uint32_t s = 0; evaluation.model && s < evaluation.model->samples(); ++s) {
    const Model& model = *evaluation.model;
    const auto [simulation, step] = model.sample(s);
    table.add("simulation", model.simulation_name(simulation), model.branch_of(simulation), step,
              model.sample_time_s(s));
    for (const float x : leading_coordinates(model, s)) table.add(x);
    for (std::uint32_t p = 0; p < parameters; ++p) table.add(model.parameter(simulation, p));
    table.end_row();
  }
  if (evaluation.rounds.empty()) return table.text();
  for (const TestTrial& test : evaluation.rounds.front().tests)
    for (const FrameTrial& frame : test.frames) {
      table.add("experiment", test.experiment, test.branch, frame.step, frame.time_s);
      for (const float x : frame.leading_coordinates) table.add(x);
      for (std::uint32_t p = 0; p < parameters; ++p) table.add("");
      table.end_row();
    }
  return table.text();
}

std::string worst_csv(std::span<const WorstTest> tests) {
  CsvTable table("experiment,branch,fold,oracle,fit,estimate,ratio,step,step_oracle,step_fit");
  table.end_row();
  for (const auto& [test, s] : tests) {
    const Score& fit = s.of(EvaluatedMethod::fit);
    table.add(test->experiment, test->branch, test->fold, s.oracle.mean, fit.mean, s.of(EvaluatedMethod::estimate).mean,
              fit.ratio, test->worst.step, test->worst.oracle, test->worst.fit);
    table.end_row();
  }
  return table.text();
}

std::string images_csv(const WorstFrame& worst) {
  CsvTable table("row,column,frame,fit,oracle");
  table.end_row();
  for (std::size_t cell = 0; cell < worst.images[0].size(); ++cell) {
    table.add(cell / worst.columns, cell % worst.columns);
    for (const auto& image : worst.images) table.add(image[cell]);
    table.end_row();
  }
  return table.text();
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
  io::write_file(folder / "tables.md", text.empty() ? "Nothing was measured.\n" : text);
  io::write_file(folder / "summary.json", to_json(evaluation) + '\n');
  io::write_file(folder / "frames.csv", frames_csv(evaluation));
  io::write_file(folder / "view.csv", view_csv(evaluation));
  const auto worst = worst_tests(evaluation);
  io::write_file(folder / "worst.csv", worst_csv(worst));
  std::error_code error;                                 // is reported when the first file is written
  std::filesystem::remove_all(folder / "worst", error);  // of an earlier evaluation
  std::filesystem::create_directories(folder / "worst", error);
  for (std::size_t i = 0; i < worst.size(); ++i)
    io::write_file(folder / "worst" / (std::to_string(i + 1) + ".csv"), images_csv(worst[i].test->worst));
}

}  // namespace lbea::tool
