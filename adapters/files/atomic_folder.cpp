#include "adapters/files/atomic_folder.hpp"

#include "adapters/files/system_files.hpp"

#include <lbea/lbea.hpp>

#include <cerrno>
#include <string>
#include <system_error>

namespace lbea::io {
namespace {

[[noreturn]] void fail(const std::filesystem::path& path, const std::string& what) {
  throw Error(Status::write_failed, path.string() + ": " + what);
}

/// "results/" is "results".
std::filesystem::path without_slash(const std::filesystem::path& path) {
  return path.has_filename() ? path : path.parent_path();
}

std::filesystem::path parent_of(const std::filesystem::path& path) {
  return path.has_parent_path() ? path.parent_path() : std::filesystem::path(".");
}

}  // namespace

void require_new_folder(const std::filesystem::path& path) {
  const std::filesystem::path name = without_slash(path).filename();
  if (name.empty() || name == "." || name == "..") fail(path, "is no name of a new folder; give another one");
  std::error_code unknown;
  const auto status = std::filesystem::symlink_status(without_slash(path), unknown);
  if (status.type() != std::filesystem::file_type::not_found)
    fail(path, unknown ? unknown.message() : "exists; give another name, or remove it");
}

AtomicFolder::AtomicFolder(std::filesystem::path final_path) : final_path_(without_slash(final_path)) {
  require_new_folder(final_path_);
  temporary_ = system::create_temporary_folder(parent_of(final_path_));
  if (temporary_.empty()) fail(final_path_, "cannot be created: " + std::generic_category().message(errno));
  path_ = temporary_ / final_path_.filename();
  std::error_code error;
  if (!std::filesystem::create_directory(path_, error)) {
    std::filesystem::remove(temporary_, error);
    fail(final_path_, "cannot be created");
  }
}

AtomicFolder::~AtomicFolder() {
  std::error_code ignored;
  std::filesystem::remove_all(temporary_, ignored);
}

void AtomicFolder::commit() {
  require_new_folder(final_path_);
  std::error_code error;
  std::filesystem::rename(path_, final_path_, error);
  if (error) fail(final_path_, "the finished folder cannot get this name: " + error.message());
  static_cast<void>(system::flush_folder(parent_of(final_path_)));
}

}  // namespace lbea::io
