#include "adapters/wire/access/keys.hpp"

#include "adapters/wire/access/key_files.hpp"

#include <lbea/lbea.hpp>

#include <sstream>
#include <system_error>

#include <zmq.h>

namespace lbea::wire {
namespace {
constexpr std::size_t key_characters = 40;
constexpr std::size_t key_bytes = 32;

struct KeyLine {
  std::string kind, key, name;
  std::size_t line = 0;
};

bool is_key(const std::string& text) {
  std::array<std::uint8_t, key_bytes> decoded;
  return text.size() == key_characters && zmq_z85_decode(decoded.data(), text.c_str()) != nullptr;
}

std::vector<KeyLine> read_lines(const std::filesystem::path& file, bool is_secret) {
  std::istringstream text(read_key_file(file, is_secret));
  std::vector<KeyLine> lines;
  std::string line;
  for (std::size_t number = 1; std::getline(text, line); ++number) {
    KeyLine found;
    found.line = number;
    std::istringstream words(line);
    if (!(words >> found.kind) || found.kind[0] == '#') continue;
    words >> found.key >> found.name;
    const bool is_known = found.kind == secret_kind || found.kind == public_kind;
    if (!is_known || !is_key(found.key))
      refuse_key_file(file, "line " + std::to_string(number) + " is not \"" + public_kind +
                                " KEY NAME\" with a KEY of 40 characters; make key files with lbea-keygen");
    lines.push_back(std::move(found));
  }
  return lines;
}

}  // namespace

void refuse_key_file(const std::filesystem::path& file, const std::string& why) {
  throw Error{Status::bad_config, file.string() + ": " + why};
}

void check_key_text(const std::filesystem::path& file, const std::string& text, bool is_secret) {
  if (text.starts_with("\xEF\xBB\xBF"))
    refuse_key_file(file, "begins with a byte order mark; save it as plain UTF-8 text without one");
  if (is_secret && text.find(secret_kind) == std::string::npos)
    refuse_key_file(file, "holds no secret key; give the .key file of lbea-keygen");
}

CurveKeyPair generate_key_pair() {
  std::array<char, key_characters + 1> public_key, secret_key;
  if (zmq_curve_keypair(public_key.data(), secret_key.data()) != 0)
    throw Error{Status::bad_config, "this libzmq was built without CURVE; install Debian's libzmq5"};
  return {public_key.data(), secret_key.data()};
}

CurveKeyPair read_key_pair(const std::filesystem::path& file) {
  CurveKeyPair keys;
  for (const KeyLine& line : read_lines(file, true)) {
    std::string& key = line.kind == secret_kind ? keys.secret_key : keys.public_key;
    if (!key.empty()) refuse_key_file(file, "holds more than one key pair; give a file of lbea-keygen");
    key = line.key;
  }
  if (keys.secret_key.empty()) refuse_key_file(file, "holds no secret key; give the .key file of lbea-keygen");
  std::array<char, key_characters + 1> derived;
  if (zmq_curve_public(derived.data(), keys.secret_key.c_str()) != 0)
    refuse_key_file(file, "its secret key cannot be used; make a new pair with lbea-keygen");
  if (!keys.public_key.empty() && keys.public_key != derived.data())
    refuse_key_file(file, "its secret and public key do not belong together; make a new pair with lbea-keygen");
  keys.public_key = derived.data();
  return keys;
}

void write_key_pair(const std::filesystem::path& base, const CurveKeyPair& keys, const std::string& name) {
  if (name.empty() || name.find_first_of(" \t\r\n") != std::string::npos)
    throw Error{Status::bad_config, "\"" + name + "\": a key's name is one word"};
  const std::string public_line = std::string(public_kind) + " " + keys.public_key + " " + name + "\n";
  std::filesystem::path secret_file = base, public_file = base;
  secret_file += ".key";
  public_file += ".pub";
  write_key_file(secret_file,
                 "# secret: stays on the machine it was made for\n" + std::string(secret_kind) + " " + keys.secret_key +
                     " " + name + "\n" + public_line,
                 true);
  try {
    write_key_file(public_file, public_line, false);
  } catch (...) {
    std::error_code ignored;
    std::filesystem::remove(secret_file, ignored);
    throw;
  }
}

std::vector<AllowedPeer> read_public_keys(const std::filesystem::path& file) {
  std::vector<AllowedPeer> peers;
  for (const KeyLine& line : read_lines(file, false)) {
    if (line.kind == secret_kind)
      refuse_key_file(file, "line " + std::to_string(line.line) +
                                " is a secret key, which does not leave its owner; give the .pub file");
    peers.push_back({line.key, line.name.empty() ? line.key.substr(0, 8) : line.name});
  }
  if (peers.empty()) refuse_key_file(file, "holds no public key; give a .pub file of lbea-keygen, or several in one");
  return peers;
}

ClientAccess read_client_access(const std::filesystem::path& server_key, const std::filesystem::path& own_keys) {
  ClientAccess access;
  if (server_key.empty()) return access;
  const auto servers = read_public_keys(server_key);
  if (servers.size() != 1) refuse_key_file(server_key, "holds several public keys; give only the matcher's");
  access.server_key = servers.front().public_key;
  if (!own_keys.empty()) access.keys = read_key_pair(own_keys);
  return access;
}

void check_access(const ServerAccess& access) {
  if (access.keys && access.allowed.empty())
    throw Error{Status::bad_config,
                "a secret key (--key) without anyone who is allowed would let everyone in; give --allow with the "
                "public keys of those who may connect"};
  if (!access.keys && !access.allowed.empty())
    throw Error{Status::bad_config,
                "an allow-list (--allow) without a secret key would not be looked at; give --key too"};
}
}  // namespace lbea::wire
