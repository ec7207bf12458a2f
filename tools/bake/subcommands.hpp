// lbea-bake plan, survey, shard, merge and status: a bake in several processes.
#pragma once

#include <optional>

namespace lbea::tool {

/// The exit code; nothing when the first argument is none of these words.
[[nodiscard]] std::optional<int> run_subcommand(int argc, char** argv);

}  // namespace lbea::tool
