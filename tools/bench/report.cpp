#include "tools/bench/report.hpp"

#include "adapters/files/atomic_file.hpp"
#include "tools/bench/build_info.hpp"
#include "tools/bench/pipeline.hpp"
#include "tools/shared/text/formatted.hpp"

#include <nlohmann/json.hpp>

#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <thread>

namespace lbea::tool::bench {
namespace {

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

// A stage that the pipeline does not have has only zero times.
bool is_absent(const Statistics& statistics) { return statistics.max <= 0; }

std::string row(const Patterns& patterns, const std::string& pipeline, const char* stage, const Statistics& s) {
  return is_absent(s) ? ""
                      : formatted(patterns.row, pipeline.c_str(), stage, s.p50, s.p90, s.p99, s.p99_9, s.max, s.mean);
}

std::string summary_of(const Measurement& m) {
  return formatted("%.0f frames/s; %llu minor and %llu major page faults, %llu preemptions in %zu frames",
                   m.frames_per_second(), static_cast<unsigned long long>(m.interruptions.minor_faults),
                   static_cast<unsigned long long>(m.interruptions.major_faults),
                   static_cast<unsigned long long>(m.interruptions.preemptions), m.frames.size());
}

std::string ratios_of(const Measurement& baseline, const Measurement& product) {
  return formatted("p50 is %.2f times that of %s by wall time, %.2f times by processor time",
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
          {"minor_faults", m.interruptions.minor_faults},
          {"major_faults", m.interruptions.major_faults},
          {"preemptions", m.interruptions.preemptions},
          {"stages_us", stages}};
}

std::string processor() {
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);)
    if (line.starts_with("model name") && line.find(": ") != std::string::npos) return line.substr(line.find(": ") + 2);
  return "unknown";
}

// The load average before the measurement.
std::string load() {
  double average = 0;
  if (getloadavg(&average, 1) != 1) return "unknown";
  return formatted("%.1f", average);
}

std::string date() {
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  gmtime_r(&now, &utc);
  char text[32];
  std::strftime(text, sizeof text, "%Y-%m-%d %H:%M UTC", &utc);
  return text;
}

std::string all_kernels() {
  std::string names;
  for (const Kernels* const* code = available_kernels(); *code != nullptr; ++code)
    names += (names.empty() ? "" : ", ") + short_name(**code);
  return short_name(kernels()) + " (of " + names + ")";
}

}  // namespace

std::string to_text(const Report& report, TableStyle style) {
  const Patterns patterns = patterns_of(style);
  std::string text;
  for (const auto& [name, value] : report.facts) text += formatted(patterns.fact, name.c_str(), value.c_str());
  text += patterns.head;
  for (const Measurement& m : report.measurements)
    for (std::size_t stage = 0; stage < stage_names.size(); ++stage)
      text += row(patterns, m.pipeline, stage_names[stage].data(), m.stage_us(stage));
  text += "\n";
  for (const Measurement& m : report.measurements)
    text += formatted(patterns.after, m.pipeline.c_str(), summary_of(m).c_str());
  for (std::size_t k = 1; k < report.measurements.size(); ++k) {
    const Measurement &product = report.measurements[0], &baseline = report.measurements[k];
    text += formatted(patterns.after, baseline.pipeline.c_str(), ratios_of(baseline, product).c_str());
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

std::vector<std::pair<std::string, std::string>> conditions() {
  return {{"machine", processor()},     {"cores", std::to_string(std::thread::hardware_concurrency())},
          {"load before", load()},      {"commit", build_commit},
          {"compiler", build_compiler}, {"flags", build_flags},
          {"kernels", all_kernels()},   {"date", date()}};
}

}  // namespace lbea::tool::bench
