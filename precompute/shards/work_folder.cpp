#include "precompute/shards/work_folder.hpp"

#include "precompute/shards/archive.hpp"

#include <lbea/lbea.hpp>

#include <array>
#include <cstdio>
#include <system_error>
#include <utility>
#include <vector>

#include <sys/stat.h>
#include <unistd.h>

namespace lbea {

namespace {

namespace fs = std::filesystem;

constexpr std::array kind_names{"", "survey", "basis", "plan", "record", "footprint", "failure"};

[[noreturn]] void cannot_create(const fs::path& folder, const std::string& reason) {
  throw Error(Status::write_failed, "cannot create " + folder.string() + ": " + reason +
                                        "; check the folder it stands in, its rights and the free space");
}

// The next free name; several bakes may make the same model at once.
fs::path passing_folder(const fs::path& model) {
  if (!model.has_filename()) cannot_create(model, "no file name");
  int error = EEXIST;
  for (int i = 0; i < 1000; ++i) {
    fs::path folder = model;
    folder += ".tmp-work-" + std::to_string(::getpid()) + "-" + std::to_string(i);
    error = ::mkdir(folder.c_str(), 0777) == 0 ? 0 : errno;
    if (error == 0) return folder;
    if (error != EEXIST) break;
  }
  cannot_create(model, std::generic_category().message(error));
}

}  // namespace

WorkFolder::WorkFolder(fs::path folder, bool is_durable) : folder_(std::move(folder)), is_durable_(is_durable) {}

void WorkFolder::create() const {
  std::error_code error;
  fs::create_directories(folder_, error);
  for (const char* kind : kind_names)
    if (!error) fs::create_directory(folder_ / kind, error);
  if (error) cannot_create(folder_, error.message());
}

fs::path WorkFolder::file(WorkName name) const {
  if (name.kind == WorkKind::plan) return folder_ / "plan" / "plan";
  std::array<char, 17> key{};
  std::snprintf(key.data(), key.size(), "%016llx", static_cast<unsigned long long>(name.key));
  return folder_ / kind_names.at(static_cast<std::size_t>(name.kind)) / key.data();
}

void WorkFolder::sweep() const {
  std::error_code error;
  std::vector<fs::path> remains;
  for (const auto& entry : fs::recursive_directory_iterator(folder_, error)) {
    const std::string name = entry.path().filename().string();
    const auto end = name.find(".tmp-");
    if (end != std::string::npos && fs::exists(entry.path().parent_path() / name.substr(0, end), error)) remains.push_back(entry.path());
  }
  for (const fs::path& path : remains) fs::remove(path, error);
}

void WorkFolder::note_failure(std::uint64_t record, const std::string& reason) const {
  WorkWriter file = writer({WorkKind::failure, record});
  Saver{file}(reason);
  file.commit();
}

void WorkFolder::forget_failure(std::uint64_t record) const {
  std::error_code none;
  fs::remove(file({WorkKind::failure, record}), none);
}

std::optional<std::string> WorkFolder::failure(std::uint64_t record) const {
  const WorkName name{WorkKind::failure, record};
  if (!has(name)) return std::nullopt;
  WorkReader file = reader(name);
  std::string reason;
  Loader{file}(reason);
  file.finish();
  return reason;
}

PassingWorkFolder::PassingWorkFolder(const fs::path& model) : folder_(passing_folder(model), false) { folder_.create(); }

PassingWorkFolder::~PassingWorkFolder() {
  std::error_code none;
  fs::remove_all(folder_.path(), none);
}

}  // namespace lbea
