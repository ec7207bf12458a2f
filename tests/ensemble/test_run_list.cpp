#include "adapters/ensemble/ensemble_toml.hpp"
#include "tests/support/files.hpp"
#include "tests/support/refusals.hpp"
#include "tests/support/test_data.hpp"

#include <doctest/doctest.h>

using namespace lbea;
using namespace lbea::io;
using namespace lbea::test;
using Paths = std::vector<std::filesystem::path>;

TEST_CASE("patterns, plain names, absolute paths; sorted by bytes") {
  const TemporaryFolder folder;
  for (const char* name : {"r/b", "r/a", "r/B", "r/a10", "r/a2", "s/x"})
    std::filesystem::create_directories(folder / name);
  put(folder / "r/file", "x");
  const auto at = [&](const std::string& name) { return folder / name; };
  CHECK(matching_paths(folder.path(), "r/a*") == Paths{at("r/a"), at("r/a10"), at("r/a2")});
  CHECK(matching_paths(folder.path(), "r/?") == Paths{at("r/B"), at("r/a"), at("r/b")});
  CHECK(matching_paths(folder.path(), "*/[xb]") == Paths{at("r/b"), at("s/x")});
  CHECK(matching_paths(folder.path(), "r/b/") == Paths{at("r/b")});
  CHECK(matching_paths(folder.path(), "./r/../r/b") == Paths{at("r/b")});
  CHECK(matching_paths(folder.path(), "r/file") == Paths{at("r/file")});
  CHECK(matching_paths("elsewhere", (folder / "r/b").string()) == Paths{at("r/b")});
  CHECK(matching_paths(folder.path(), "r/none").empty());
  CHECK(matching_paths(folder.path(), "none*").empty());
}

TEST_CASE("signs of a pattern in the folder's own name are letters") {
  const TemporaryFolder outer;
  const auto folder = outer / "tests [2024] * why? a\\b";
  std::filesystem::create_directories(folder / "runs/a");
  CHECK(matching_paths(folder, "runs/*") == Paths{folder / "runs/a"});
  CHECK(matching_paths(folder, "runs/a") == Paths{folder / "runs/a"});
  CHECK(means_run("runs/a", folder, folder / "runs/a"));
  CHECK(means_run("a", folder, folder / "runs/a"));
}

TEST_CASE("without a folder patterns begin where the program stands") {
  const TemporaryFolder folder;
  std::filesystem::create_directories(folder / "r/a");
  const auto before = std::filesystem::current_path();
  std::filesystem::current_path(folder.path());
  const Paths found = matching_paths("", "r/*");
  std::filesystem::current_path(before);
  CHECK(found == Paths{"r/a"});
}

TEST_CASE("a folder that is not there holds no run; one that cannot be looked through is refused") {
  const TemporaryFolder folder;
  CHECK(matching_paths(folder.path(), "absent/*").empty());
  CHECK(matching_paths(folder / "absent", "*/a").empty());
  std::filesystem::create_symlink("endless", folder / "endless");
  const auto refused = error_of([&] { static_cast<void>(matching_paths(folder.path(), "endless/*")); });
  check_error(refused, Status::bad_input, {"endless/*", folder.path().string(), "cannot read the folders"});
  check_error(error_of([&] { static_cast<void>(matching_paths("", (folder / "endless/*").string())); }),
              Status::bad_input, {"in .;"});
}

TEST_CASE("a run is meant by path, name or pattern, and by nothing less") {
  CHECK(means_run("runs/run_1", "base", "base/runs/run_1"));
  CHECK(means_run("runs/run_1/", "base", "base/runs/run_1"));
  CHECK(means_run("runs/*", "base", "base/runs/run_1"));
  CHECK(means_run("run_1", "base", "base/runs/run_1"));
  CHECK(means_run("run_?", "base", "base/runs/run_1"));
  CHECK(means_run("/data/run_1", "base", "/data/run_1"));
  CHECK(means_run("run_1", "", "run_1"));
  CHECK(means_run("run[1]", "base", "base/run[1]"));
  CHECK(means_run("runs/run[1]", "base", "base/runs/run[1]"));
  CHECK_FALSE(means_run("run_1", "base", "base/runs/run_10"));
  CHECK_FALSE(means_run("runs", "base", "base/runs/run_1"));
  CHECK_FALSE(means_run("other/run_1", "base", "base/runs/run_1"));
}
