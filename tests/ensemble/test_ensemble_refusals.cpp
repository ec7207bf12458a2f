#include "adapters/ensemble/ensemble_toml.hpp"
#include "adapters/ensemble/toml_table.hpp"
#include "tests/support/files.hpp"
#include "tests/support/refusals.hpp"
#include "tests/support/test_data.hpp"

#include <doctest/doctest.h>

using namespace lbea;
using namespace lbea::bake;
using namespace lbea::io;
using namespace lbea::test;

namespace {

/// Reads "runs" in line 1 and `text` from line 2 on; refused with line 2 and all of `words`.
void check_refused(const std::string& text, const std::vector<std::string>& words) {
  const TemporaryFolder folder;
  std::filesystem::create_directories(folder / "runs/a");
  const auto file = put(folder / "ensemble.toml", "runs = [\"runs/*\"]\n" + text);
  const Error error = error_of([&] { (void)read_ensemble_toml(file); });
  CAPTURE(text);
  check_error(error, Status::bad_input, words);
  CHECK(mentions(error, file.string() + ", line 2: "));
}

}  // namespace

TEST_CASE("unknown keys are refused with what may have been meant") {
  check_refused("mods = 10", {"unknown key \"mods\"", "did you mean \"mode"});
  check_refused("envelop_margin = 10", {"did you mean \"envelope_margin\"?"});
  check_refused("region = {box = {min = [0, 0, 0], max = [1, 1, 1], middle = 1}}", {"region.box.middle"});
  check_refused("region = {part = [1]}", {"unknown key \"region.part\"", "did you mean \"parts\"?"});
  check_refused("steps = {begin = 1}", {"steps.begin", "first, last, stride"});
  check_refused("colour = \"red\"", {"known here: runs, exclude"});
}

TEST_CASE("values of another type are refused with key and line") {
  check_refused("modes = \"many\"", {"\"modes\"", "whole number", "string"});
  check_refused("modes = 10.0", {"\"modes\"", "whole number"});
  check_refused("modes = -1", {"\"modes\""});
  check_refused("modes = 4294967296", {"\"modes\""});
  check_refused("modes = 0", {"at least 1"});
  check_refused("length_unit = 1", {"\"length_unit\"", "text"});
  check_refused("length_unit = \"\"", {"empty"});
  check_refused("envelope_margin = \"25\"", {"\"envelope_margin\"", "number"});
  check_refused("envelope_margin = nan", {"finite"});
  check_refused("envelope_margin = true", {"\"envelope_margin\"", "boolean"});
  check_refused("envelope_margin = -1", {"negative"});
  check_refused("correspondence = 1", {"true or false"});
  check_refused("exclude = \"a\"", {"\"exclude\"", "list"});
  check_refused("exclude = [1]", {"\"exclude\"", "integer"});
  check_refused("region = 1", {"\"region\"", "table"});
  check_refused("region = {parts = [1, -1]}", {"region.parts"});
  check_refused("region = {nodes = 1}", {"region.nodes"});
  check_refused("region = {box = {min = [0, 0], max = [1, 1, 1]}}", {"region.box.min", "three"});
  check_refused("region = {box = {min = [0, 0, 0]}}", {"min and max"});
  check_refused("region = {box = {max = [0, 0, 0]}}", {"min and max"});
  check_refused("rigid = [12, 40]", {"rigid", "three nodes"});
  check_refused("rigid = \"nodes\"", {"rigid", "\"fit\""});
  check_refused("mapping = {parts = {a = 1}}", {"mapping.parts", "{101 = 1, 102 = 2}"});
  check_refused("mapping = {parts = {-1 = 1}}", {"mapping.parts"});
  check_refused("mapping = {parts = {1 = 4294967296}}", {"mapping.parts"});
  check_refused("mapping = {parts = [1]}", {"mapping.parts", "array"});
  check_refused("mapping = {parts = \"none\"}", {"mapping.parts", "ignore"});
  check_refused("mapping = {distance = 0}", {"mapping.distance", "positive"});
  check_refused("mapping = {share = 1.5}", {"mapping.share", "above 1"});
  check_refused("mapping = {distnace = 1}", {"did you mean \"distance\"?"});
  check_refused("landmarks = 1", {"\"landmarks\"", "true or false"});
  check_refused("region = {box = {min = [0, 0, 2], max = [1, 1, 1]}}", {"above max"});
  check_refused("region = {sensor = \"\"}", {"region.sensor", "empty"});
  check_refused("views = []", {"views", "empty"});
  check_refused("views = [\"a.json\", \"\"]", {"views", "empty"});
  check_refused("steps = 1", {"\"steps\"", "table"});
  check_refused("steps = []", {"empty"});
  check_refused("steps = [1, 2, 1]", {"step 1 twice"});
  check_refused("steps = {stride = 0}", {"steps.stride"});
  check_refused("steps = {first = 5, last = 4}", {"steps.last"});
  check_refused("mode = \"overtime\"", {"did you mean \"over-time\"?"});
  check_refused("fields = \"stress\"", {"\"all\""});
  check_refused("fields = [\"stress\", \"strain\", \"stress\"]", {"names \"stress\" twice"});
  check_refused("time_unit = \"min\"", {"\"time_unit\""});
  check_refused("time_unit = 0", {"positive"});
}

TEST_CASE("channels that cannot be are refused with key and line") {
  check_refused("channel = {}", {"needs tables, each under [[channel]]"});
  check_refused("channel = [{kind = \"displacement\"}]", {"\"channel.name\" is missing"});
  check_refused("channel = [{name = \"a\"}]", {"\"channel.kind\" is missing", "intrusion"});
  check_refused("channel = [{name = \"a\", kind = \"velocty\"}]", {"did you mean \"velocity\"?"});
  check_refused("channel = [{name = \"a\", kind = \"velocity\", component = \"w\"}]", {"cannot be \"w\""});
  for (const char* points : {"4711", "[-1]", "[1.5]", "[[1, 2]]", "[[1, 2, nan]]", "[\"a\"]"})
    check_refused(std::string("channel = [{name = \"a\", kind = \"velocity\", points = ") + points + "}]",
                  {"needs a list of node numbers or places"});
  check_refused("channel = [{name = \"a\", kind = \"mean\", field = 1}]", {"\"channel.field\"", "text in quotes"});
  for (const char* key : {"parts", "elements"})
    check_refused(std::string("channel = [{name = \"a\", kind = \"mean\", ") + key + " = []}]",
                  {std::string("\"channel.") + key + "\" is empty; remove it for all"});
  check_refused("channel = [{name = \"a\", kind = \"history\"}]", {"\"channel.history\" is missing"});
  check_refused("channel = [{name = \"a\", kind = \"history\", history = \"b\", part = 1, wall = 1}]",
                {"\"channel.wall\"", "give one of them"});
  check_refused("channel = [{name = \"a\", kind = \"history\", history = \"b\", part = -1}]", {"\"channel.part\""});
  check_refused("channel = [{name = \"a\", kind = \"velocity\", wall = 1}]", {"of kind \"history\" only"});
  check_refused("channel = [{name = \"a\", kind = \"velocity\", node = 1}]", {"unknown key \"channel.node\""});
}

TEST_CASE("runs that are not there") {
  check_refused("exclude = [\"b\"]", {"\"b\"", "none of the runs"});
  check_refused("exclude = [\"*\"]", {"leaves no run"});
  check_refused("reference_run = \"b\"", {"\"b\"", "none of the runs"});

  const TemporaryFolder folder;
  const auto refusal = [&](const std::string& text) {
    return error_of([&] { (void)read_ensemble_toml(put(folder / "ensemble.toml", text)); });
  };
  CHECK(mentions(refusal("\n\nruns = [\"x*\"]"), "line 3: \"runs\" names \"x*\""));
  CHECK(mentions(refusal("\nruns = [\"absent/*\"]"), "line 2: \"runs\" names \"absent/*\""));
  CHECK(mentions(refusal("runs = [\"x\"]"), "no such file"));
  CHECK(mentions(refusal("runs = []"), "missing or empty"));
  CHECK(mentions(refusal(""), "missing or empty"));
}

TEST_CASE("a file that is not TOML, or not there") {
  const TemporaryFolder folder;
  const auto refusal = [&](const std::string& text) {
    return error_of([&] { (void)read_ensemble_toml(put(folder / "ensemble.toml", text)); });
  };
  CHECK(refusal("modes = 1\nmodes = = 2").status == Status::bad_input);
  CHECK(mentions(refusal("modes = 1\nmodes = = 2"), "line 2"));
  CHECK(refusal("modes = 1\nmodes = 2").status == Status::bad_input);
  CHECK(refusal(std::string("\0\xff", 2)).status == Status::bad_input);
  CHECK(refusal("a = " + std::string(100'000, '[')).status == Status::bad_input);
  std::string dotted = "modes = 1\na";  // overran the stack
  for (int i = 0; i < 100'000; ++i) dotted += ".a";
  CHECK(mentions(refusal(dotted + " = 1"), "line 2: a key with too many dots"));
  CHECK(error_of([&] { (void)read_ensemble_toml(folder / "absent.toml"); }).status == Status::file_not_found);
}

TEST_CASE("edit distance: known values, symmetry, and the empty word") {
  CHECK(edit_distance("", "") == 0);
  CHECK(edit_distance("", "abc") == 3);
  CHECK(edit_distance("kitten", "sitting") == 3);
  CHECK(edit_distance("sitting", "kitten") == 3);
  CHECK(edit_distance("flaw", "lawn") == 2);
  CHECK(edit_distance("modes", "modes") == 0);
}
