// Where a bake in shards keeps what is finished: one folder that all its processes see.
#pragma once

#include "precompute/jobs/work_file.hpp"

#include <filesystem>
#include <optional>
#include <string>

namespace lbea::bake {

class WorkFolder {
 public:
  /// Creates nothing yet. is_durable: see WorkWriter.
  explicit WorkFolder(std::filesystem::path folder, bool is_durable = true);
  /// One that is soon gone with all in it: not durable, not swept.
  [[nodiscard]] static WorkFolder passing(std::filesystem::path folder);

  /// Throws Error{write_failed} when it cannot.
  void create() const;
  [[nodiscard]] const std::filesystem::path& path() const noexcept { return folder_; }
  /// By kind and key; the plan has no key, there is one.
  [[nodiscard]] std::filesystem::path file(WorkName name) const;
  [[nodiscard]] bool has(WorkName name) const { return is_finished(file(name), name); }
  [[nodiscard]] WorkWriter writer(WorkName name) const { return {file(name), name, is_durable_}; }
  [[nodiscard]] WorkReader reader(WorkName name) const { return {file(name), name}; }

  /// A damaged file, for the step that writes it to make it anew.
  void remove(const DamagedWorkFile& damaged) const;
  /// Removes what writers that died left behind of files that others have finished since.
  void sweep() const;

  /// Why a record could not be made: kept for status and merge until it can.
  void note_failure(std::uint64_t record, const std::string& reason) const;
  void forget_failure(std::uint64_t record) const;
  [[nodiscard]] std::optional<std::string> failure(std::uint64_t record) const;

 private:
  std::filesystem::path folder_;
  bool is_durable_, is_passing_ = false;
};

/// For a bake in one process: beside the model, gone with this object; with the next bake of this model, when it is
/// killed.
class PassingWorkFolder {
 public:
  /// Throws Error{write_failed}.
  explicit PassingWorkFolder(const std::filesystem::path& model);
  PassingWorkFolder(const PassingWorkFolder&) = delete;
  PassingWorkFolder& operator=(const PassingWorkFolder&) = delete;
  [[nodiscard]] const WorkFolder& folder() const noexcept { return folder_; }

 private:
  /// The next free name; several bakes may make the same model at once.
  struct Place {
    explicit Place(const std::filesystem::path& model);
    ~Place();
    Place(const Place&) = delete;
    Place& operator=(const Place&) = delete;
    std::filesystem::path path;
    int descriptor = -1;  // holds the claim
  };
  Place place_;
  WorkFolder folder_;
};

}  // namespace lbea::bake
