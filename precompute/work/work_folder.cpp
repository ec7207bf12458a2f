#include "precompute/work/work_folder.hpp"

#include "precompute/work/archive.hpp"
#include "precompute/work/stale_files.hpp"

#include <cerrno>
#include <cstdio>
#include <system_error>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

namespace lbea::bake {
namespace {
namespace fs = std::filesystem;

constexpr std::array kind_names{"", "survey", "basis", "plan", "record", "footprint", "failure"};  // by WorkKind

[[noreturn]] void cannot_create(const fs::path& folder, const std::string& reason) {
  throw Error(Status::write_failed, "cannot create " + folder.string() + ": " + reason +
                                        "; check its parent folder, the rights and the free space");
}
}  // namespace

WorkFolder::WorkFolder(fs::path folder, bool is_durable) : folder_(std::move(folder)), is_durable_(is_durable) {}

WorkFolder WorkFolder::temporary(fs::path folder) {
  WorkFolder work(std::move(folder), false);
  work.is_temporary_ = true;
  return work;
}

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
  if (is_temporary_) return;
  std::error_code error;
  std::vector<fs::path> stale;
  for (const auto& entry : fs::recursive_directory_iterator(folder_, error)) {
    const std::string name = entry.path().filename().string();
    const auto end = name.find(".tmp-");
    if (end != std::string::npos && fs::exists(entry.path().parent_path() / name.substr(0, end), error))
      stale.push_back(entry.path());
  }
  for (const fs::path& path : stale) fs::remove(path, error);
}

void WorkFolder::remove(const DamagedWorkFile& damaged) const {
  std::error_code none;
  fs::remove(damaged.file, none);
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

TemporaryWorkFolder::Place::Place(const fs::path& model) {
  if (!model.has_filename()) cannot_create(model, "no file name");
  int error = EEXIST;
  for (int i = 0; i < 1000 && error == EEXIST; ++i) {
    path = model.string() + temporary_suffix(temporary_folder, i);
    error = ::mkdir(path.c_str(), 0777) == 0 ? 0 : errno;
  }
  if (error != 0) cannot_create(model, std::generic_category().message(error));
  descriptor = ::open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor >= 0) static_cast<void>(lock_file(descriptor));
}

TemporaryWorkFolder::Place::~Place() {
  remove_all_of(path);
  if (descriptor >= 0) ::close(descriptor);
}

TemporaryWorkFolder::TemporaryWorkFolder(const fs::path& model)
    : place_(model), folder_(WorkFolder::temporary(place_.path)) {
  remove_stale_files(model);
  folder_.create();
}
}  // namespace lbea::bake
