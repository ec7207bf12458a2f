#include "tools/bench/report.hpp"

#include "adapters/files/atomic_file.hpp"

#include <nlohmann/json.hpp>

#include <array>
#include <cstdio>

namespace lbea::tool::bench {
namespace {

template <typename... Values>
std::string format(const char* pattern, Values... values) {
  std::array<char, 512> line{};
  std::snprintf(line.data(), line.size(), pattern, values...);
  return line.data();
}

struct Patterns {
  const char *fact, *head, *row, *after;
};

// Columns: pipeline, stage, p50, p90, p99, p99.9, max, mean.
Patterns patterns_of(TableStyle style) {
  if (style == TableStyle::markdown)
    return {"- %s: %s\n",
            "\n| us | stage | p50 | p90 | p99 | p99.9 | max | mean |\n|---|---|--:|--:|--:|--:|--:|--:|\n",
            "| %s | %s | %.1f | %.1f | %.1f | %.1f | %.1f | %.1f |\n", "- %s: %s\n"};
  return {"%-12s %s\n",
          "\nus               stage                p50       p90       p99     p99.9       max      mean\n",
          "%-16s %-14s %9.1f %9.1f %9.1f %9.1f %9.1f %9.1f\n", "%s: %s\n"};
}

// Stages that a pipeline does not have take no time at all.
bool is_absent(const Statistics& statistics) { return statistics.max <= 0; }

std::string row(const Patterns& patterns, const std::string& pipeline, const char* stage, const Statistics& s) {
  return is_absent(s) ? "" : format(patterns.row, pipeline.c_str(), stage, s.p50, s.p90, s.p99, s.p99_9, s.max, s.mean);
}

std::string summary_of(const Measurement& m) {
  return format("%.0f frames/s; %llu minor and %llu major page faults, %llu preemptions in %zu frames",
                m.frames_per_second(), static_cast<unsigned long long>(m.disturbances.minor_faults),
                static_cast<unsigned long long>(m.disturbances.major_faults),
                static_cast<unsigned long long>(m.disturbances.preemptions), m.frames.size());
}

std::string ratios_of(const Measurement& baseline, const Measurement& product) {
  return format("p50 is %.2f times that of %s by wall time, %.2f times by processor time",
                ratio(baseline, product, total_stage), product.pipeline.c_str(),
                ratio(baseline, product, processor_stage));
}

nlohmann::ordered_json json_of(const Statistics& s) {
  return {{"p50", s.p50}, {"p90", s.p90}, {"p99", s.p99}, {"p99_9", s.p99_9}, {"max", s.max}, {"mean", s.mean}};
}

nlohmann::ordered_json json_of(const Measurement& m) {
  nlohmann::ordered_json stages;
  for (std::size_t stage = 0; stage < stage_names.size(); ++stage) {
    const Statistics statistics = m.stage_us(stage);
    if (!is_absent(statistics)) stages[std::string(stage_names[stage])] = json_of(statistics);
  }
  return {{"pipeline", m.pipeline},
          {"frames", m.frames.size()},
          {"frames_per_second", m.frames_per_second()},
          {"minor_faults", m.disturbances.minor_faults},
          {"major_faults", m.disturbances.major_faults},
          {"preemptions", m.disturbances.preemptions},
          {"stages_us", stages}};
}

}  // namespace

std::string to_text(const Report& report, TableStyle style) {
  const Patterns patterns = patterns_of(style);
  std::string text;
  for (const auto& [name, value] : report.facts) text += format(patterns.fact, name.c_str(), value.c_str());
  text += patterns.head;
  for (const Measurement& m : report.measurements)
    for (std::size_t stage = 0; stage < stage_names.size(); ++stage)
      text += row(patterns, m.pipeline, stage_names[stage].data(), m.stage_us(stage));
  text += "\n";
  for (const Measurement& m : report.measurements)
    text += format(patterns.after, m.pipeline.c_str(), summary_of(m).c_str());
  for (std::size_t k = 1; k < report.measurements.size(); ++k) {
    const Measurement &product = report.measurements[0], &baseline = report.measurements[k];
    text += format(patterns.after, baseline.pipeline.c_str(), ratios_of(baseline, product).c_str());
  }
  return text;
}

std::string to_json(const Report& report) {
  nlohmann::ordered_json json;
  for (const auto& [name, value] : report.facts) json["facts"][name] = value;
  for (const Measurement& m : report.measurements) {
    nlohmann::ordered_json entry = json_of(m);
    entry["p50_over_product"] = {{"total", ratio(m, report.measurements.front(), total_stage)},
                                 {"processor", ratio(m, report.measurements.front(), processor_stage)}};
    json["pipelines"].push_back(entry);
  }
  return json.dump(2);
}

void write_csv(const std::filesystem::path& path, const Report& report) {
  io::AtomicFile file(path);
  std::string header = "pipeline,frame,cloud,points";
  for (const std::string_view stage : stage_names) header += "," + std::string(stage) + "_ns";
  file.write(header + "\n");
  for (const Measurement& m : report.measurements)
    for (std::size_t i = 0; i < m.frames.size(); ++i) {
      const BenchCloud& cloud = report.clouds[m.frames[i].cloud];
      std::string row = "\"" + m.pipeline + "\"," + std::to_string(i) + ",\"" + cloud.name + "\"," +
                        std::to_string(cloud.points.size());
      for (const std::uint64_t ns : m.frames[i].ns) row += "," + std::to_string(ns);
      file.write(row + "\n");
    }
  file.commit();
}

}  // namespace lbea::tool::bench
