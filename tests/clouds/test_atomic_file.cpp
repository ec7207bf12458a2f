#include "adapters/files/atomic_file.hpp"
#include "tests/support/files.hpp"
#include "tests/support/refusals.hpp"
#include "tests/support/test_data.hpp"

#include <doctest/doctest.h>
#include <lbea/lbea.hpp>

#include <string>

#include <sys/stat.h>

using namespace lbea;
using namespace lbea::io;
using namespace lbea::test;
namespace fs = std::filesystem;

namespace {

std::string content(const fs::path& file) { return std::string(as_text(read_file(file))); }

}  // namespace

TEST_CASE("what was written is what is read, for every size around the buffer") {
  const TemporaryFolder folder;
  for (const std::size_t size : {std::size_t{0}, std::size_t{1}, std::size_t{2}, (std::size_t{1} << 18) - 1,
                                 std::size_t{1} << 18, (std::size_t{1} << 18) + 1, std::size_t{3'000'000}}) {
    std::string text(size, ' ');
    for (std::size_t i = 0; i < size; ++i) text[i] = static_cast<char>(i * 31 + i / 251);
    for (const std::size_t piece : {std::size_t{7'001}, std::size_t{1} << 18, size + 1}) {
      AtomicFile file(folder / "out");
      for (std::size_t at = 0; at < size; at += piece) file.write(std::string_view(text).substr(at, piece));
      CHECK(file.size() == size);
      file.commit();
      CHECK(content(folder / "out") == text);
    }
  }
  CHECK(files_in(folder.path()) == 1);
}

TEST_CASE("the file is not there before commit, and an older one stays until then") {
  const TemporaryFolder folder;
  {
    AtomicFile file(folder / "new");
    file.write("half");
    CHECK_FALSE(fs::exists(folder / "new"));
    CHECK(files_in(folder.path()) == 1);
  }
  CHECK(files_in(folder.path()) == 0);

  put(folder / "old", "first");
  {
    AtomicFile file(folder / "old");
    file.write("second");
    CHECK(content(folder / "old") == "first");
  }
  CHECK(content(folder / "old") == "first");
  AtomicFile file(folder / "old");
  file.write("second");
  file.commit();
  CHECK(content(folder / "old") == "second");
}

TEST_CASE("two writers of one name do not disturb each other; the last commit wins") {
  const TemporaryFolder folder;
  AtomicFile one(folder / "out"), two(folder / "out");
  one.write("one");
  two.write("two");
  two.commit();
  CHECK(content(folder / "out") == "two");
  one.commit();
  CHECK(content(folder / "out") == "one");
  CHECK(files_in(folder.path()) == 1);
}

TEST_CASE("the rights are those of an ordinary new file") {
  const TemporaryFolder folder;
  const mode_t before = umask(027);
  {
    AtomicFile file(folder / "out");
    file.commit();
  }
  umask(before);
  CHECK(fs::status(folder / "out").permissions() == static_cast<fs::perms>(0640));
}

TEST_CASE("a disk that is full at any byte leaves the folder as it was") {
  const TemporaryFolder folder;
  put(folder / "out", "old");
  const std::string piece(150'000, 'x');
  const std::uint64_t total = 4 * piece.size();
  for (const rlim_t limit : {rlim_t{0}, rlim_t{1}, rlim_t{150'000}, rlim_t{262'144}, rlim_t{599'999}}) {
    const Error error = error_of([&] {
      const FullDisk full(limit);
      AtomicFile file(folder / "out");
      for (int i = 0; i < 4; ++i) file.write(piece);
      file.commit();
    });
    CHECK(error.status == Status::write_failed);
    CHECK(mentions(error, (folder / "out").string()));
    CHECK(mentions(error, "byte " + std::to_string(limit)));
    CHECK(mentions(error, "File too large"));
    CHECK(content(folder / "out") == "old");
    CHECK(files_in(folder.path()) == 1);
  }
  const FullDisk just_enough(total);
  AtomicFile file(folder / "out");
  for (int i = 0; i < 4; ++i) file.write(piece);
  file.commit();
  CHECK(fs::file_size(folder / "out") == total);
}

TEST_CASE("a folder that is not there, and a name that is a folder, are refused in words") {
  const TemporaryFolder folder;
  const Error absent = error_of([&] { AtomicFile file(folder.path() / "no" / "out"); });
  CHECK(absent.status == Status::write_failed);
  CHECK(mentions(absent, "No such file or directory"));

  fs::create_directory(folder / "taken");
  put(folder.path() / "taken" / "inside", "x");
  const Error taken = error_of([&] {
    AtomicFile file(folder / "taken");
    file.commit();
  });
  CHECK(taken.status == Status::write_failed);
  CHECK(files_in(folder.path()) == 1);
  CHECK(error_of([&] { AtomicFile file(folder.path() / ""); }).status == Status::write_failed);
}

TEST_CASE("reading what cannot be read") {
  const TemporaryFolder folder;
  CHECK(error_of([&] { (void)read_file(folder / "absent"); }).status == Status::file_not_found);
  put(folder / "file", "x");
  CHECK(error_of([&] { (void)read_file(folder.path() / "file" / "below"); }).status == Status::file_not_found);
  CHECK(error_of([&] { (void)read_file(folder.path()); }).status == Status::bad_input);
  CHECK(error_of([&] { (void)read_file("/dev/null"); }).status == Status::bad_input);
  mkfifo((folder / "pipe").c_str(), 0600);
  CHECK(error_of([&] { (void)read_file(folder / "pipe"); }).status == Status::bad_input);  // and does not wait
}
