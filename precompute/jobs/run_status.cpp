#include "precompute/jobs/run_status.hpp"

#include "precompute/jobs/remains.hpp"

#include <chrono>
#include <filesystem>
#include <optional>
#include <set>
#include <system_error>

namespace lbea::bake {
namespace {

namespace fs = std::filesystem;

/// On this machine by the process itself, for others by how lately it has written.
bool is_being_written(const fs::directory_entry& entry, const TemporaryName& name, double patience_s) {
  std::error_code error;
  if (name.host == host_name()) return !is_abandoned(entry.path()).value_or(!is_alive(name.process));
  const auto changed = entry.last_write_time(error);
  return !error && std::chrono::duration<double>(fs::file_time_type::clock::now() - changed).count() <= patience_s;
}

/// Final names of a kind's files that somebody is writing.
std::set<std::string> in_the_making(const WorkFolder& work, WorkKind kind, double patience_s) {
  std::set<std::string> names;
  const fs::path folder = work.file({kind, 0}).parent_path();
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    const auto name = parse_temporary(entry.path().filename().string());
    if (name && is_being_written(entry, *name, patience_s)) names.insert(name->final_name);
  }
  return names;
}

}  // namespace

std::vector<RunStatus> run_status(const WorkFolder& work, const BakePlan& plan, double patience_s) {
  const auto records = in_the_making(work, WorkKind::record, patience_s),
             footprints = in_the_making(work, WorkKind::footprint, patience_s);
  std::vector<RunStatus> status;
  for (std::size_t run = 0; run < plan.runs.size(); ++run) {
    const PlannedRun& planned = plan.runs[run];
    const bool is_running = records.contains(work.file(planned.record_name()).filename().string()) ||
                            footprints.contains(work.file(planned.footprint_name()).filename().string());
    const auto failure = planned.failure.empty() ? work.failure(planned.record) : std::optional(planned.failure);
    if (failure && !planned.failure.empty())
      status.push_back({RunProgress::failed, *failure});
    else if (work.has(planned.record_name()) && work.has(planned.footprint_name()))
      status.push_back({RunProgress::finished, ""});
    else if (is_running)
      status.push_back({RunProgress::running, ""});
    else
      status.push_back(failure ? RunStatus{RunProgress::failed, *failure} : RunStatus{});
  }
  return status;
}

}  // namespace lbea::bake
