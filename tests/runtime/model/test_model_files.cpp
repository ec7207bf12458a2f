// Model files as they occur: named in any language, damaged, read-only, replaced or written to while they are open.
#include "tests/support/test_data.hpp"

#include <lbea/lbea.h>
#include <lbea/lbea.hpp>

#include <doctest/doctest.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <optional>
#include <vector>

using namespace lbea;
namespace fs = std::filesystem;

namespace {
const fs::path sample = test::data() / "fuzz" / "model" / "impact.lbea", other = sample.parent_path() / "views.lbea";

std::string utf8(const fs::path& file) {
  const std::u8string text = file.u8string();
  return {text.begin(), text.end()};
}

std::vector<char> bytes_of(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// The status of opening it from C. A refusal is a sentence that begins with the file's name.
lbea_status opened(const fs::path& file) {
  lbea_model* model = nullptr;
  const lbea_status status = lbea_model_open(utf8(file).c_str(), &model);
  if (status == LBEA_OK)
    CHECK(model != nullptr);
  else {
    CAPTURE(std::string(lbea_last_error()));
    CHECK(model == nullptr);
    CHECK(std::string(lbea_last_error()).starts_with(utf8(file) + ": "));
  }
  lbea_model_close(model);
  return status;
}
}  // namespace

TEST_CASE("a model is opened by a name in UTF-8, in any language") {
  const test::TemporaryFolder folder;
  const fs::path inside = folder.path() / fs::path(u8"Stoßprüfung 模型");
  const fs::path file = inside / fs::path(u8"Längsträger.lbea");
  fs::create_directory(inside);
  CHECK(opened(file) == LBEA_FILE_NOT_FOUND);
  fs::copy_file(sample, file);
  CHECK(opened(file) == LBEA_OK);
  CHECK(Model::open(file).checksum() == Model::open(sample).checksum());
  CHECK(opened(inside) == LBEA_NOT_A_MODEL);
  lbea_model* model = nullptr;
  CHECK(lbea_model_open("no-utf8-\xff.lbea", &model) == LBEA_FILE_NOT_FOUND);
  CHECK(std::string(lbea_last_error()).starts_with("no-utf8-\xff.lbea: "));
}

TEST_CASE("a damaged model is refused in a sentence") {
  const test::TemporaryFolder folder;
  const std::vector<char> whole = bytes_of(sample);
  const fs::path file = folder / "damaged.lbea";
  for (const std::size_t length :
       {std::size_t{0}, std::size_t{10}, std::size_t{4096}, whole.size() / 2, whole.size() - 1}) {
    CAPTURE(length);
    std::ofstream(file, std::ios::binary).write(whole.data(), static_cast<std::streamsize>(length));
    const lbea_status status = opened(file);
    CHECK((status == LBEA_NOT_A_MODEL || status == LBEA_CORRUPT_MODEL));
  }
  for (std::size_t at = 0; at < whole.size(); at += whole.size() / 50) {
    CAPTURE(at);
    std::vector<char> damaged = whole;
    damaged[at] = static_cast<char>(~damaged[at]);
    std::ofstream(file, std::ios::binary).write(damaged.data(), static_cast<std::streamsize>(damaged.size()));
    opened(file);  // a byte between two sections may be anything
  }
}

TEST_CASE("a read-only model is opened") {
  const test::TemporaryFolder folder;
  const fs::path file = folder / "read-only.lbea";
  fs::copy_file(sample, file);
  fs::permissions(file, fs::perms::owner_read | fs::perms::group_read | fs::perms::others_read);
  CHECK(opened(file) == LBEA_OK);
  fs::permissions(file, fs::perms::owner_all);
}

TEST_CASE("a model stays what it is when another one takes its name, or a program tries to write to it") {
  const test::TemporaryFolder folder;
  const fs::path file = folder / "model.lbea", next = folder / "next.lbea";
  fs::copy_file(sample, file);
  fs::copy_file(other, next);
  std::optional<Model> model = Model::open(file);
  const std::vector<float> positions = [&] {
    const auto of_last = model->node_positions(model->samples() - 1);
    return std::vector<float>(of_last.begin(), of_last.end());
  }();
  const auto is_unchanged = [&] { return std::ranges::equal(positions, model->node_positions(model->samples() - 1)); };

  // Systems that let others write tell it; others refuse the writing.
  const bool is_written = static_cast<bool>(std::ofstream(file, std::ios::binary | std::ios::app) << "x" << std::flush);
  CHECK(model->file_was_written() == is_written);
  if (is_written) {
    fs::resize_file(file, fs::file_size(sample));
    model.emplace(Model::open(file));
  }
  CHECK(model->hold(Method::vtp));
  CHECK(is_unchanged());

  std::error_code refused;  // a system may refuse it
  fs::rename(next, file, refused);
  CHECK(is_unchanged());
  CHECK(Model::open(file).checksum() == Model::open(refused ? sample : other).checksum());
}

#ifdef _WIN32
TEST_CASE("a model that another program writes is refused until that has ended") {
  const test::TemporaryFolder folder;
  const fs::path file = folder / "model.lbea";
  fs::copy_file(sample, file);
  {
    const std::ofstream writer(file, std::ios::binary | std::ios::app);
    CHECK(opened(file) == LBEA_FILE_NOT_FOUND);
    CHECK(std::string(lbea_last_error()).ends_with("; close the program that writes it"));
  }
  CHECK(opened(file) == LBEA_OK);
}

TEST_CASE("devices are not models") { CHECK(opened("NUL") == LBEA_NOT_A_MODEL); }
#endif
