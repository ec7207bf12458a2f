#include "tools/shared/cli/scratch_folder.hpp"

#include <lbea/lbea.hpp>

#include <cstdlib>

namespace lbea::tool {

ScratchFolder::ScratchFolder(const std::filesystem::path& parent) {
  std::error_code error;
  std::filesystem::create_directories(parent, error);
  std::string name = (parent / ".lbea-XXXXXX").string();
  if (error || ::mkdtemp(name.data()) == nullptr)
    throw Error(Status::write_failed, parent.string() + ": cannot create a folder in it; choose another one");
  path_ = name;
}

ScratchFolder::~ScratchFolder() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
}

}  // namespace lbea::tool
