#include "tools/bench/machine.hpp"

#include "tools/bench/build_info.hpp"
#include "tools/bench/pipeline.hpp"

#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <thread>

namespace lbea::tool::bench {
namespace {

std::string processor() {
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);)
    if (line.starts_with("model name") && line.find(": ") != std::string::npos) return line.substr(line.find(": ") + 2);
  return "unknown";
}

// Other programs' share of the machine when the measurement begins.
std::string load() {
  double average = 0;
  if (getloadavg(&average, 1) != 1) return "unknown";
  char text[32];
  std::snprintf(text, sizeof text, "%.1f", average);
  return text;
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

std::vector<std::pair<std::string, std::string>> circumstances() {
  return {{"machine", processor()},     {"cores", std::to_string(std::thread::hardware_concurrency())},
          {"load before", load()},      {"commit", build_commit},
          {"compiler", build_compiler}, {"flags", build_flags},
          {"kernels", all_kernels()},   {"date", date()}};
}

}  // namespace lbea::tool::bench
