// lbea-inspect on models: output and exit codes.
#include "tests/runtime/model/forged_model.hpp"
#include "tests/support/files.hpp"
#include "tests/tools/bake_program.hpp"

#include <lbea/lbea.hpp>

#include <doctest/doctest.h>
#include <nlohmann/json.hpp>

using namespace lbea;
using namespace lbea::test;

namespace {

struct Baked {
  TemporaryFolder folder;

  Baked() { lbea_bake(folder, demo + "/ensemble.toml --modes 10 --steps 0,20 -o m.lbea"); }
  [[nodiscard]] Outcome inspect(const std::string& arguments) const {
    return run_program(std::string(LBEA_INSPECT) + " " + arguments, folder.path());
  }
};

}  // namespace

TEST_CASE("an intact model is listed as text") {
  const Baked baked;
  const Outcome outcome = baked.inspect("m.lbea");
  CHECK(outcome.exit_code == 0);
  for (const char* words : {"m.lbea: intact", "plastic_strain", "run_023", "t_front [mm]=1.31136", "coefficients",
                            "made_by", "kept_variance"})
    CHECK_MESSAGE(outcome.out.find(words) != std::string::npos, words);
}

TEST_CASE("an intact model is listed as JSON") {
  const Baked baked;
  const Outcome outcome = baked.inspect("m.lbea --json");
  CHECK(outcome.exit_code == 0);
  const auto json = nlohmann::json::parse(outcome.out);
  CHECK(json["bytes"] == std::filesystem::file_size(baked.folder / "m.lbea"));
  CHECK(json["sizes"]["samples"] == 20);
  CHECK(json["simulations"].size() == 10);
  CHECK(json["simulations"][0]["samples"] == 2);
  CHECK(json["simulations"][0]["parameters"]["t_front [mm]"] == 1.31136);
  CHECK(json["provenance"]["configuration"]["modes"] == 10);
  CHECK(json["provenance"]["inputs"][0]["name"] == "run_023");
  CHECK(json["provenance"]["inputs"][0]["files"][0]["name"] == "d3plot");
  CHECK(json["provenance"]["inputs"][0]["files"][0]["size"] ==
        std::filesystem::file_size(data() / "rail-demo" / "runs" / "run_023" / "d3plot"));
  std::uint64_t end = 64 + 64 * json["sections"].size();
  for (const auto& section : json["sections"]) {
    CHECK(section["offset"] == end);
    end = (section["offset"].get<std::uint64_t>() + section["bytes"].get<std::uint64_t>() + 63) / 64 * 64;
  }
  CHECK(end == json["bytes"]);
}

TEST_CASE("a model lists the rigs whose depth images it holds") {
  const TemporaryFolder folder;
  auto right = nlohmann::json::parse(text_of(demo + "/sensor.json"));
  double& x = *right["T_reference_sensor"][0][3].get_ptr<double*>();
  x += 50;
  put(folder / "right.json", right.dump());
  REQUIRE(lbea_bake(folder, demo + "/ensemble.toml --modes 10 --steps 0,20 --views " + demo +
                                "/sensor.json --views right.json -o m.lbea")
              .exit_code == 0);
  const Outcome outcome = run_program(std::string(LBEA_INSPECT) + " m.lbea --json", folder.path());
  const auto views = nlohmann::json::parse(outcome.out)["views"];
  REQUIRE(views.size() == 2);
  CHECK(views[0]["T_reference_sensor"][3].get<double>() == doctest::Approx(x - 50));
  CHECK(views[1]["T_reference_sensor"][3].get<double>() == doctest::Approx(x));
}

TEST_CASE("the learned forecast is listed over the duration, of frames seen from the beginning") {
  const TemporaryFolder folder;
  REQUIRE(lbea_bake(folder, demo + "/ensemble.toml --modes 10 --views " + demo + "/sensor.json -o m.lbea").exit_code ==
          0);
  const Outcome outcome = run_program(std::string(LBEA_INSPECT) + " m.lbea --json", folder.path());
  const auto forecast = nlohmann::json::parse(outcome.out)["forecast"];
  const auto errors = forecast["error_90"].get<std::vector<double>>();
  REQUIRE(errors.size() == 11);
  CHECK(errors.back() < errors.front());  // the more is seen, the less is uncertain
  for (const double error : errors) CHECK((error > 0 && error <= 1.2 * errors.front()));
  REQUIRE_FALSE(forecast["parameters"].empty());
  for (const auto& entry : forecast["parameters"].items()) {
    CAPTURE(entry.key());
    const auto& parameter = entry.value();
    REQUIRE(parameter["r2"].size() == 11);
    for (const auto& r2 : parameter["r2"]) CHECK(r2.get<double>() <= 1);
    for (const auto& bound : parameter["bound_90"]) CHECK(bound.get<double>() >= 0);
  }
}

TEST_CASE("a provenance nested deeper than a bake writes is printed as text: a million levels overran the stack") {
  const Baked baked;
  std::string bytes = text_of(baked.folder / "m.lbea");
  forge(std::as_writable_bytes(std::span(bytes)), format::SectionId::provenance,
        [](format::SectionEntry&, std::span<std::byte> section) {
          std::ranges::fill(section.first(section.size() / 2), std::byte{'['});
          std::ranges::fill(section.subspan(section.size() / 2), std::byte{']'});
          if (section.size() % 2 != 0) section[section.size() / 2] = std::byte{0x20};
        });
  put(baked.folder / "nested.lbea", bytes);
  const Outcome outcome = baked.inspect("nested.lbea --json");
  CHECK(outcome.exit_code == 0);
  CHECK(nlohmann::json::parse(outcome.out)["provenance"].is_string());
}

TEST_CASE("a damaged model gives exit code 1 and names the section") {
  const Baked baked;
  const auto file = baked.folder / "m.lbea";
  const auto json = nlohmann::json::parse(baked.inspect("m.lbea --json").out);
  for (const auto& section : json["sections"]) {
    if (section["bytes"] == 0) continue;
    const auto at =
        static_cast<std::streamoff>(section["offset"].get<std::uint64_t>() + section["bytes"].get<std::uint64_t>() / 2);
    std::fstream stream(file, std::ios::in | std::ios::out | std::ios::binary);
    const char byte = static_cast<char>(stream.seekg(at).get());
    stream.seekp(at).put(static_cast<char>(byte ^ 0x10)).flush();
    const Outcome outcome = baked.inspect("m.lbea");
    CHECK(outcome.exit_code == 1);
    CHECK(outcome.out.empty());
    const std::string name =
        "section " + std::to_string(section["id"].get<int>()) + " '" + section["title"].get<std::string>() + "'";
    CHECK_MESSAGE(outcome.err.find(name) != std::string::npos, outcome.err);
    stream.seekp(at).put(byte).flush();
  }
  CHECK(baked.inspect("m.lbea").exit_code == 0);
  std::filesystem::resize_file(file, 1000);
  CHECK(baked.inspect("m.lbea").err.find("should have") != std::string::npos);
}

TEST_CASE("a file that is no model and a missing file are failures; a missing argument is wrong usage") {
  const TemporaryFolder folder;
  std::ofstream(folder / "text") << std::string(500, 'x');
  const auto inspect = [&](const std::string& arguments) {
    return run_program(std::string(LBEA_INSPECT) + " " + arguments, folder.path());
  };
  CHECK(inspect("text").exit_code == 1);
  CHECK(inspect("text").err.find("text") != std::string::npos);
  CHECK(inspect("none").exit_code == 1);
  CHECK(inspect("").exit_code == 2);
  CHECK(inspect("--help").exit_code == 0);
}
