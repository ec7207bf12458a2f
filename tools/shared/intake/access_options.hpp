// --key, --allow, --server-key: the same options in every program that binds or connects.
#pragma once

#include "adapters/wire/access/keys.hpp"

#include "tools/shared/cli/command_line.hpp"

#include <string>
#include <vector>

namespace lbea::tool {

struct ServerAccessOptions {
  std::string key_file;
  std::vector<std::string> allow_files, listener_files;
  std::uint32_t max_peers = wire::ServerAccess{}.max_peers;
  void add_to(CommandLine& app);
  /// For a program that also publishes.
  void add_listeners_to(CommandLine& app);
  /// Reads the files, for an endpoint that receives frames. Throws Error.
  [[nodiscard]] wire::ServerAccess load() const;
  /// For an endpoint that publishes.
  [[nodiscard]] wire::ServerAccess load_for_listeners() const;
};

struct ClientAccessOptions {
  std::string server_key_file, key_file;
  void add_to(CommandLine& app);
  /// Reads the files. Throws Error.
  [[nodiscard]] wire::ClientAccess load() const;
};

}  // namespace lbea::tool
