#include "tools/bake/steps.hpp"

#include "tools/shared/text/formatted.hpp"
#include "tools/shared/text/printable.hpp"

#include <nlohmann/json.hpp>

#include <cstdio>

namespace lbea::tool {
namespace {

using Json = nlohmann::ordered_json;

void print(const Json& json) { std::printf("%s\n", json.dump(2, ' ', false, Json::error_handler_t::replace).c_str()); }

std::string size_text(std::uint64_t bytes) {
  const bool is_large = bytes >= 1'000'000'000;
  return formatted("%.1f %s", static_cast<double>(bytes) / (is_large ? 1e9 : 1e6), is_large ? "GB" : "MB");
}

std::string joined(const std::vector<std::string>& names, std::size_t most) {
  std::string text;
  for (std::size_t i = 0; i < std::min(most, names.size()); ++i) text += (i > 0 ? ", " : "") + names[i];
  return text + (names.size() > most ? ", ..." : "");
}

void print_left_out(const std::string& run, const std::string& reason) {
  std::printf("left out       %s: %s\n", printable(run).c_str(), printable(reason).c_str());
}

/// The runs with the largest distances.
void print_mapped(const bake::BakeSummary& summary) {
  constexpr std::size_t most = 5;
  std::vector<bake::MappedRunReport> runs = summary.mapped;
  std::ranges::stable_sort(runs, std::ranges::greater{}, [](const auto& run) { return run.mapping.largest; });
  const char* unit = summary.length_unit.c_str();
  for (std::size_t i = 0; i < std::min(most, runs.size()); ++i) {
    const bake::MappingReport& m = runs[i].mapping;
    std::printf(
        "mapped         %s: %u of %u elements onto %u of another mesh; nodes %.2g %s off in the mean, %.2g %s at "
        "element %u, after a smooth difference of %.2g %s%s\n",
        printable(runs[i].name).c_str(), m.mapped_elements, m.elements, m.run_elements, m.mean, unit, m.largest, unit,
        m.worst_element, m.shift, unit, m.tells_parts ? "" : "; parts not compared");
  }
  if (runs.size() > most) std::printf("mapped         %zu more runs, nearer\n", runs.size() - most);
}

Json mapped_runs(const bake::BakeSummary& summary) {
  Json mapped = Json::array();
  for (const bake::MappedRunReport& run : summary.mapped)
    mapped.push_back({{"run", run.name},
                      {"run_elements", run.mapping.run_elements},
                      {"elements", run.mapping.elements},
                      {"mapped_elements", run.mapping.mapped_elements},
                      {"mean_distance", run.mapping.mean},
                      {"largest_distance", run.mapping.largest},
                      {"worst_element", run.mapping.worst_element},
                      {"largest_shift", run.mapping.shift},
                      {"parts_compared", run.mapping.tells_parts}});
  return mapped;
}

/// Of a statistic of a field: "minimum of FIELD on N elements".
std::string statistic_text(const bake::ChannelReport& channel) {
  return formatted("%s of %s on %zu elements", std::string(to_string(channel.kind)).c_str(),
                   printable(channel.field).c_str(), channel.elements.size());
}

/// "history part_mass of part 5, CFC 60".
std::string history_text(const bake::ChannelReport& channel) {
  return "history " + printable(channel.history.text()) +
         (channel.cfc == 0 ? "" : ", CFC " + std::to_string(channel.cfc));
}

/// With the distances of the nodes from given points.
void print_channels(const bake::BakeSummary& summary) {
  for (const bake::ChannelReport& channel : summary.channels) {
    if (channel.node_ids.empty()) {
      const bool is_history = channel.kind == ChannelKind::history;
      std::printf("channel        %s [%s]: %s\n", printable(channel.name).c_str(), printable(channel.unit).c_str(),
                  (is_history ? history_text(channel) : statistic_text(channel)).c_str());
      continue;
    }
    std::string nodes;
    for (std::size_t i = 0; i < channel.node_ids.size(); ++i) {
      nodes += (i == 0 ? "" : ", ") + std::to_string(channel.node_ids[i]);
      if (channel.distances[i] > 0)
        nodes += formatted(" (%.3g %s from the point)", channel.distances[i], summary.length_unit.c_str());
    }
    std::printf("channel        %s [%s]: %s %s at node %s\n", printable(channel.name).c_str(), channel.unit.c_str(),
                std::string(to_string(channel.kind)).c_str(), std::string(to_string(channel.component)).c_str(),
                nodes.c_str());
  }
}

Json channels_of(const bake::BakeSummary& summary) {
  Json channels = Json::array();
  for (const bake::ChannelReport& channel : summary.channels)
    channels.push_back({{"name", channel.name},
                        {"unit", channel.unit},
                        {"kind", to_string(channel.kind)},
                        {"component", to_string(channel.component)},
                        {"cfc", channel.cfc},
                        {"nodes", channel.node_ids},
                        {"distances", channel.distances},
                        {"field", channel.field.empty() ? Json() : Json(channel.field)},
                        {"elements", channel.elements.size()},
                        {"history", channel.history.name.empty() ? Json() : Json(channel.history.text())}});
  return channels;
}

void print_facts(const bake::BakeSummary& summary) {
  std::printf("size           %.4g x %.4g x %.4g %s, all samples\n", static_cast<double>(summary.size[0]),
              static_cast<double>(summary.size[1]), static_cast<double>(summary.size[2]), summary.length_unit.c_str());
  std::printf("times          %.4g s to %.4g s, %.3g s apart\n", summary.first_s, summary.last_s, summary.interval_s);
  for (const bake::SimulationField& field : summary.stored_fields)
    std::printf("field          %s%s%s\n", printable(field.name).c_str(), field.source.empty() ? "" : ": ",
                printable(field.source).c_str());
  const bake::MeshLosses& losses = summary.losses;
  if (losses.eroded + losses.missing > 0)
    std::printf("left out       %u of %u elements and %u of %u nodes: %u eroded in all samples, %u not in all runs\n",
                losses.eroded + losses.missing, losses.elements, losses.nodes_left_out, losses.nodes, losses.eroded,
                losses.missing);
  if (losses.eroding > 0)
    std::printf("eroding        %u of %u elements in some samples of %zu runs (%s)\n", losses.eroding, losses.elements,
                losses.runs.size(), printable(joined(losses.runs, 3)).c_str());
  print_mapped(summary);
  print_channels(summary);
  if (losses.exposed > 0) std::printf("added          %u faces that erosion exposes\n", losses.exposed);
  for (const std::string& warning : summary.warnings) std::printf("warning        %s\n", printable(warning).c_str());
}

Json facts(const bake::BakeSummary& summary) {
  const bake::MeshLosses& losses = summary.losses;
  Json fields = Json::array();
  for (const bake::SimulationField& field : summary.stored_fields)
    fields.push_back({{"name", field.name}, {"unit", field.unit}, {"source", field.source}});
  return {{"length_unit", summary.length_unit},
          {"size", summary.size},
          {"first_s", summary.first_s},
          {"last_s", summary.last_s},
          {"interval_s", summary.interval_s},
          {"stored_fields", fields},
          {"surface",
           {{"elements", losses.elements},
            {"nodes", losses.nodes},
            {"eroded", losses.eroded},
            {"missing", losses.missing},
            {"eroding", losses.eroding},
            {"nodes_left_out", losses.nodes_left_out},
            {"exposed", losses.exposed},
            {"eroding_runs", losses.runs}}},
          {"mapped", mapped_runs(summary)},
          {"channels", channels_of(summary)},
          {"warnings", summary.warnings}};
}

std::size_t count(const std::vector<bake::RunStatus>& runs, bake::RunProgress progress) {
  return static_cast<std::size_t>(std::ranges::count(runs, progress, &bake::RunStatus::progress));
}

}  // namespace

void print_table(const bake::BakeSummary& summary, const std::filesystem::path& model) {
  const auto& seconds = summary.seconds;
  const double all = seconds.reading + seconds.bases + seconds.samples + seconds.writing;
  std::printf("model          %s, %.1f MB\n", model.c_str(), static_cast<double>(summary.file_size) / 1e6);
  std::printf("samples        %u of %u simulations\n", summary.samples, summary.simulations);
  std::printf("component      %u nodes, %u elements, %u fields, %u parameters\n", summary.nodes, summary.elements,
              summary.fields, summary.parameters);
  print_facts(summary);
  for (const bake::RoundedField& field : summary.rounded_fields)
    std::printf("               %s [%s] in 16 bits, within %.3g\n", printable(field.name).c_str(),
                printable(field.unit).c_str(), static_cast<double>(field.largest_error));
  std::printf("region         %u vertices, %u reference mesh%s\n", summary.vertices, summary.references,
              summary.references == 1 ? "" : "es");
  std::printf("basis          %u modes, eigenvalues to %.3g, residual %.1e, %s\n", summary.modes,
              summary.highest_eigenvalue, summary.basis_residual, summary.basis_solver.c_str());
  if (summary.basis_residual > bake::largest_usual_residual)
    std::printf(
        "               warning: the residual is above %.0e, because the region has very narrow or very small "
        "elements;\n"
        "               the modes are less exact: leave these elements out of the region or mesh it more evenly\n",
        bake::largest_usual_residual);
  if (summary.degenerate_triangles > 0)
    std::printf("               skipped %zu triangles without area\n", summary.degenerate_triangles);
  if (std::isnan(summary.kept_variance))
    std::printf("kept variance  the samples do not vary\n");
  else
    std::printf("kept variance  %.4f %%\n", 100 * summary.kept_variance);
  for (const bake::RunLeftOut& run : summary.left_out) print_left_out(run.name, run.reason);
  std::printf("time           %.2f s: reading %.2f, bases %.2f, samples %.2f, writing %.2f\n", all, seconds.reading,
              seconds.bases, seconds.samples, seconds.writing);
}

void print_json(const bake::BakeSummary& summary, const std::filesystem::path& model) {
  Json left_out = Json::array();
  for (const bake::RunLeftOut& run : summary.left_out) left_out.push_back({{"run", run.name}, {"reason", run.reason}});
  Json rounded = Json::array();
  for (const bake::RoundedField& field : summary.rounded_fields)
    rounded.push_back({{"name", field.name}, {"unit", field.unit}, {"largest_error", field.largest_error}});
  Json json{{"model", model.string()},
            {"file_size", summary.file_size},
            {"samples", summary.samples},
            {"simulations", summary.simulations},
            {"nodes", summary.nodes},
            {"elements", summary.elements},
            {"fields", summary.fields},
            {"rounded_fields", rounded},
            {"parameters", summary.parameters},
            {"vertices", summary.vertices},
            {"references", summary.references},
            {"modes", summary.modes},
            {"highest_eigenvalue", summary.highest_eigenvalue},
            {"basis_residual", summary.basis_residual},
            {"basis_solver", summary.basis_solver},
            {"degenerate_triangles", summary.degenerate_triangles},
            {"kept_variance", summary.kept_variance},
            {"left_out", left_out},
            {"seconds",
             {{"reading", summary.seconds.reading},
              {"bases", summary.seconds.bases},
              {"samples", summary.seconds.samples},
              {"writing", summary.seconds.writing}}}};
  json.update(facts(summary));
  print(json);
}

void print_table(const bake::BakePlan& plan, const bake::BakeEstimate& estimate) {
  const double seconds = estimate.seconds_per_sample * static_cast<double>(estimate.samples);
  std::printf("work           %zu runs, %zu samples\n", estimate.runs, estimate.samples);
  std::printf("model          %s, and %s in the work folder\n", size_text(estimate.model_bytes).c_str(),
              size_text(estimate.work_bytes).c_str());
  std::printf("matching       needs %s of the model in memory\n", size_text(estimate.hot_bytes).c_str());
  std::printf("memory         %s per shard and %s per thread, plus the memory for reading a state\n",
              size_text(estimate.shared_bytes).c_str(), size_text(estimate.thread_bytes).c_str());
  std::printf("time           %.1f ms per sample on this machine: %.3f processor hours\n",
              1e3 * estimate.seconds_per_sample, seconds / 3600);
  for (std::size_t run = 0; run < plan.runs.size(); ++run)
    if (!plan.runs[run].failure.empty()) print_left_out(plan.ensemble.runs[run].name, plan.runs[run].failure);
}

void print_json(const bake::BakePlan& plan, const bake::BakeEstimate& estimate) {
  Json left_out = Json::array();
  for (std::size_t run = 0; run < plan.runs.size(); ++run)
    if (!plan.runs[run].failure.empty())
      left_out.push_back({{"run", plan.ensemble.runs[run].name}, {"reason", plan.runs[run].failure}});
  print({{"runs", estimate.runs},
         {"samples", estimate.samples},
         {"model_bytes", estimate.model_bytes},
         {"hot_bytes", estimate.hot_bytes},
         {"work_bytes", estimate.work_bytes},
         {"shared_bytes", estimate.shared_bytes},
         {"thread_bytes", estimate.thread_bytes},
         {"seconds_per_sample", estimate.seconds_per_sample},
         {"left_out", left_out}});
}

void print_table(const bake::BakePlan& plan, const std::vector<bake::RunStatus>& runs) {
  std::printf("finished  %zu of %zu\nrunning   %zu\nwaiting   %zu\nfailed    %zu\n",
              count(runs, bake::RunProgress::finished), runs.size(), count(runs, bake::RunProgress::running),
              count(runs, bake::RunProgress::waiting), count(runs, bake::RunProgress::failed));
  for (std::size_t run = 0; run < runs.size(); ++run)
    if (runs[run].progress == bake::RunProgress::failed)
      std::printf("  %s: %s\n", printable(plan.ensemble.runs[run].name).c_str(), printable(runs[run].reason).c_str());
}

void print_json(const bake::BakePlan& plan, const std::vector<bake::RunStatus>& runs) {
  Json failed = Json::array();
  for (std::size_t run = 0; run < runs.size(); ++run)
    if (runs[run].progress == bake::RunProgress::failed)
      failed.push_back({{"run", plan.ensemble.runs[run].name}, {"reason", runs[run].reason}});
  print({{"runs", runs.size()},
         {"finished", count(runs, bake::RunProgress::finished)},
         {"running", count(runs, bake::RunProgress::running)},
         {"waiting", count(runs, bake::RunProgress::waiting)},
         {"failed", failed}});
}

void print_table(const bake::ShardSummary& summary) {
  std::printf("%zu runs in this shard: %zu were finished, %zu baked, %zu failed\n", summary.runs, summary.finished,
              summary.runs - summary.finished - summary.failed, summary.failed);
  if (summary.renewed > 0)
    std::printf("%zu of them were updated without reading the run: only the box or the rig had changed\n",
                summary.renewed);
}

}  // namespace lbea::tool
