// lbea-inspect: verifies a model and prints what is inside.
#include "tools/common/tool.hpp"
#include "tools/inspect/model_report.hpp"

#include <filesystem>

int main(int argc, char** argv) {
  using namespace lbea;
  Tool tool("lbea-inspect", "Verifies a model file, every byte of it, and prints what is inside.",
            "lbea-inspect rail.lbea");
  std::filesystem::path file;
  bool json = false;
  tool.add_option("MODEL", file, "the model file")->required();
  tool.add_flag("--json", json, "print as JSON");
  return tool.run(argc, argv, [&] {
    json ? print_model_json(file) : print_model(file);
    return int{exit_ok};
  });
}
