// CURVE keys, their files, and access settings. Set-up only: the functions throw Error.
//
// A key file has lines of three words, KIND KEY NAME: KIND is lbea-secret-key or lbea-public-key, KEY has 40 characters
// of Z85, and NAME is the owner's name in logs. Empty lines and lines that begin with # are skipped.
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

/// The peers that may connect to a bound socket. Without keys: all processes of this machine.
struct ServerAccess {
  std::optional<CurveKeyPair> keys;
  std::vector<AllowedPeer> allowed;  // with keys: only these
  std::uint32_t max_peers = 16;      // maximum connections at a time
};

/// The keys for a connection to a server.
struct ClientAccess {
  std::string server_key;            // public key; empty: a server without keys
  std::optional<CurveKeyPair> keys;  // the client's own keys, which the server must allow
};

[[nodiscard]] CurveKeyPair generate_key_pair();
/// Writes `base`.key (both keys, readable only by its owner) and `base`.pub (the public key), with the name `name`.
/// Throws Error{write_failed} when one of the files exists.
void write_key_pair(const std::filesystem::path& base, const CurveKeyPair& keys, const std::string& name);
/// Throws Error{bad_config} when users other than the owner may read the file, or when the keys do not match.
[[nodiscard]] CurveKeyPair read_key_pair(const std::filesystem::path& file);
/// The public keys of a file, at least one. Throws Error{bad_config} when all users may change the file.
[[nodiscard]] std::vector<AllowedPeer> read_public_keys(const std::filesystem::path& file);

/// From the files of the server's public key and of the client's own keys; an empty name: none. Throws
/// Error{bad_config} when the first one holds several keys.
[[nodiscard]] ClientAccess read_client_access(const std::filesystem::path& server_key,
                                              const std::filesystem::path& own_keys = {});

/// Throws Error{bad_config} for keys without an allow-list, which ZeroMQ treats as "allow all", and for the reverse.
void check_access(const ServerAccess& access);
}  // namespace lbea::wire
