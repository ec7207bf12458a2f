// Who may speak to whom: CURVE keys and the files that hold them. Set-up only: everything here throws Error.
//
// A key file has lines of three words, KIND KEY NAME, where KIND is lbea-secret-key or lbea-public-key, KEY 40
// characters of Z85 and NAME what logs call the owner. Empty lines and those that begin with # are skipped.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace lbea::wire {

struct CurveKeyPair {
  std::string public_key, secret_key;  // Z85, 40 characters
};

struct AllowedPeer {
  std::string public_key, name;
};

/// Who may connect to a socket that is bound. Without keys: anyone who reaches it, and only this machine may.
struct ServerAccess {
  std::optional<CurveKeyPair> keys;
  std::vector<AllowedPeer> allowed;  // with keys: nobody else
  std::uint32_t max_peers = 16;      // connections at a time; more are turned away
};

/// What a client needs to connect to a server with keys.
struct ClientAccess {
  std::string server_key;            // public; empty: a server without keys
  std::optional<CurveKeyPair> keys;  // the client's own, which the server must allow
};

[[nodiscard]] CurveKeyPair generate_key_pair();
/// Writes `base`.key (both keys, readable by its owner alone) and `base`.pub (the public one), named `name`.
/// Throws Error{write_failed} when one of them exists.
void write_key_pair(const std::filesystem::path& base, const CurveKeyPair& keys, const std::string& name);
/// Throws Error{bad_config} when others than the owner may read the file, or the keys do not belong together.
[[nodiscard]] CurveKeyPair read_key_pair(const std::filesystem::path& file);
/// The public keys of a file, at least one. Throws Error{bad_config} when anybody may change the file.
[[nodiscard]] std::vector<AllowedPeer> read_public_keys(const std::filesystem::path& file);

/// Throws Error{bad_config} for keys without anyone allowed, which ZeroMQ would take for "anyone", and the reverse.
void check_access(const ServerAccess& access);

}  // namespace lbea::wire
