// One progress line per stage of a bake.
#pragma once

#include "precompute/bake_options.hpp"
#include "tools/shared/cli/progress.hpp"

#include <optional>
#include <string>

namespace lbea::tool {

class StageProgress {
 public:
  void show(const bake::BakeProgress& progress) {
    if (!line_ || progress.stage != stage_) line_.emplace(std::string(progress.stage), progress.total);
    stage_ = progress.stage;
    line_->advance_to(progress.done);
  }
  void end() { line_.reset(); }

 private:
  std::string stage_;
  std::optional<Progress> line_;
};

}  // namespace lbea::tool
