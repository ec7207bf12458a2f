// lbea-keygen: makes a pair of keys for encrypted connections.
#include "adapters/wire/access/keys.hpp"
#include "tools/shared/cli/tool.hpp"

#include <cstdio>

namespace lbea::tool {
namespace {

constexpr auto description =
    "Makes a pair of CURVE keys: BASE.key (secret, readable only by you) and BASE.pub (for the other side).\n"
    "Every program needs its own pair. Existing files are never overwritten.";

int make_keys(const std::filesystem::path& base, std::string name) {
  if (name.empty()) name = base.filename().string();
  const wire::CurveKeyPair keys = wire::generate_key_pair();
  wire::write_key_pair(base, keys, name);
  const std::string text = base.string();
  std::printf("%s.key (secret) and %s.pub: %s\n", text.c_str(), text.c_str(), keys.public_key.c_str());
  return exit_ok;
}

}  // namespace
}  // namespace lbea::tool

int main(int argc, char** argv) {
  std::filesystem::path base;
  std::string name;
  lbea::tool::Tool tool("lbea-keygen", lbea::tool::description,
                        "lbea-keygen matcher   # then: lbea-serve ... --key matcher.key --allow camera.pub");
  tool.add_option("base", base, "path of the files, without extension")->required();
  tool.add_option("--name", name, "name of the owner in logs, one word (default: the file's name)");
  return tool.run(argc, argv, [&] { return lbea::tool::make_keys(base, name); });
}
