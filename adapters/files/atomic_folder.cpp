#include "adapters/files/atomic_folder.hpp"

#include "runtime/src/model/descriptor.hpp"

#include <lbea/lbea.hpp>

#include <cerrno>
#include <cstdlib>
#include <string>
#include <system_error>

#include <fcntl.h>

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
  std::string name = (parent_of(final_path_) / ".lbea-XXXXXX").string();
  if (::mkdtemp(name.data()) == nullptr)
    fail(final_path_, "cannot be created: " + std::generic_category().message(errno));
  temporary_ = name;
  path_ = temporary_ / final_path_.filename();  // mkdtemp gives nobody else access
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
  const Descriptor parent(::open(parent_of(final_path_).c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (parent.value() >= 0) ::fsync(parent.value());
}

}  // namespace lbea::io
