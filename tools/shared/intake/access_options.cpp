#include "tools/shared/intake/access_options.hpp"

#include "adapters/files/file_names.hpp"

namespace lbea::tool {

namespace {

void add_keys(wire::ServerAccess& access, const std::vector<std::string>& files) {
  for (const std::string& file : files)
    for (wire::AllowedPeer& peer : wire::read_public_keys(io::path_of(file))) access.allowed.push_back(std::move(peer));
}

}  // namespace

void ServerAccessOptions::add_to(CommandLine& app) {
  app.add_option("--key", key_file,
                 "this program's secret key (.key of lbea-keygen): encrypts, and admits only the keys of --allow");
  app.add_option("--allow", allow_files,
                 "public keys (.pub of lbea-keygen) of the peers that may connect; may be repeated");
  app.add_option("--max-peers", max_peers,
                 "maximum connections per endpoint; one of several keys may hold half of them")
      ->check(in_range(1u, 1000u));
}

void ServerAccessOptions::add_listeners_to(CommandLine& app) {
  app.add_option("--allow-listen", listener_files,
                 "public keys of the peers that may receive what is published, but not send frames; may be repeated");
}

wire::ServerAccess ServerAccessOptions::load() const {
  wire::ServerAccess access;
  access.max_peers = max_peers;
  if (!key_file.empty()) access.keys = wire::read_key_pair(io::path_of(key_file));
  add_keys(access, allow_files);
  wire::check_access(access);
  return access;
}

wire::ServerAccess ServerAccessOptions::load_for_listeners() const {
  wire::ServerAccess access = load();
  add_keys(access, listener_files);
  wire::check_access(access);
  return access;
}

void ClientAccessOptions::add_to(CommandLine& app) {
  auto* server = app.add_option("--server-key", server_key_file, "public key (.pub) of the matcher, if it has one");
  app.add_option("--key", key_file, "this program's secret key (.key of lbea-keygen), which the matcher must allow")
      ->needs(server);
}

wire::ClientAccess ClientAccessOptions::load() const {
  return wire::read_client_access(io::path_of(server_key_file), io::path_of(key_file));
}

}  // namespace lbea::tool
