// The folder of a bake's intermediate results. All processes of a bake in shards share one.
#pragma once

#include "precompute/work/work_file.hpp"

namespace lbea::bake {
class WorkFolder {
 public:
  /// Creates nothing yet. is_durable: see WorkWriter.
  explicit WorkFolder(std::filesystem::path folder, bool is_durable = true);
  /// For a bake in one process, see TemporaryWorkFolder: not durable, sweep() does nothing.
  [[nodiscard]] static WorkFolder temporary(std::filesystem::path folder);

  /// Throws Error{write_failed}.
  void create() const;
  [[nodiscard]] const std::filesystem::path& path() const noexcept { return folder_; }
  /// Its path follows from kind and key; there is only one plan.
  [[nodiscard]] std::filesystem::path file(WorkName name) const;
  [[nodiscard]] bool has(WorkName name) const { return is_finished(file(name), name); }
  [[nodiscard]] WorkWriter writer(WorkName name) const { return {file(name), name, is_durable_}; }
  [[nodiscard]] WorkReader reader(WorkName name) const { return {file(name), name}; }

  /// The step that writes the damaged file then makes it again.
  void remove(const DamagedWorkFile& damaged) const;
  /// Removes temporary files of killed writers where another process has finished the file since.
  void sweep() const;

  /// Why a record could not be made; kept for status and merge until it is made.
  void note_failure(std::uint64_t record, const std::string& reason) const;
  void forget_failure(std::uint64_t record) const;
  [[nodiscard]] std::optional<std::string> failure(std::uint64_t record) const;

 private:
  std::filesystem::path folder_;
  bool is_durable_, is_temporary_ = false;
};

/// The work folder of a bake in one process, beside the model. The destructor removes it; after a kill, the next bake
/// of the same model does.
class TemporaryWorkFolder {
 public:
  /// Throws Error{write_failed}.
  explicit TemporaryWorkFolder(const std::filesystem::path& model);
  TemporaryWorkFolder(const TemporaryWorkFolder&) = delete;
  TemporaryWorkFolder& operator=(const TemporaryWorkFolder&) = delete;
  [[nodiscard]] const WorkFolder& folder() const noexcept { return folder_; }

 private:
  /// Takes the next free name: several bakes may make the same model at once.
  struct Place {
    explicit Place(const std::filesystem::path& model);
    ~Place();
    Place(const Place&) = delete;
    Place& operator=(const Place&) = delete;
    std::filesystem::path path;
    int descriptor = -1;  // holds the lock
  };
  Place place_;
  WorkFolder folder_;
};
}  // namespace lbea::bake
