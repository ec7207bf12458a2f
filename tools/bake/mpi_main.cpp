// lbea-bake-mpi: the steps of a bake as one MPI job. Ranks exchange data through the work folder; MPI synchronizes the
// steps.
#include "tools/bake/steps.hpp"

#include <mpi.h>

#include <exception>

namespace {

using namespace lbea;
using namespace lbea::tool;

/// MPI is initialized until the end of the scope.
class Ranks {
 public:
  Ranks(int& argc, char**& argv) {
    MPI_Init(&argc, &argv);
    MPI_Comm_rank(MPI_COMM_WORLD, &rank_);
    MPI_Comm_size(MPI_COMM_WORLD, &size_);
  }
  ~Ranks() { MPI_Finalize(); }
  Ranks(const Ranks&) = delete;
  Ranks& operator=(const Ranks&) = delete;

  [[nodiscard]] bool is_first() const noexcept { return rank_ == 0; }
  [[nodiscard]] bake::Shard shard() const noexcept {
    return {static_cast<std::uint32_t>(rank_), static_cast<std::uint32_t>(size_)};
  }

  /// Runs this rank's part of a step and waits for all ranks. When one rank fails, all ranks throw.
  template <class Body>
  void together(const Body& body) const {
    std::exception_ptr failure;
    try {
      body();
    } catch (...) { failure = std::current_exception(); }
    int failed = failure ? 1 : 0, any = 0;
    MPI_Allreduce(&failed, &any, 1, MPI_INT, MPI_MAX, MPI_COMM_WORLD);
    if (failure) std::rethrow_exception(failure);
    if (any != 0)
      throw Error(Status::bad_input, "another rank failed, see its message; finished runs stay in the work folder");
  }

 private:
  int rank_ = 0, size_ = 1;
};

int bake_with(const Ranks& ranks, const BakeCommand& command, const bake::WorkFolder& work) {
  ranks.together([&] { survey_step(command, work, ranks.shard()); });
  ranks.together([&] {
    if (ranks.is_first()) (void)plan_step(command, work);
  });
  ranks.together([&] { shard_step(work, read_plan(work), ranks.shard(), command.threads); });
  ranks.together([&] {
    if (!ranks.is_first()) return;
    std::filesystem::path output;
    const bake::BakeSummary summary = merge_step(work, read_plan(work), output, command.threads);
    command.json ? print_json(summary, output) : print_table(summary, output);
  });
  return exit_ok;
}

}  // namespace

int main(int argc, char** argv) {
  const Ranks ranks(argc, argv);
  Tool tool("lbea-bake-mpi",
            "Bakes an ensemble of simulations into one model file, as one MPI job. Broken runs are left out and named.",
            "mpirun -n 64 lbea-bake-mpi ensemble.toml --work work -o rail.lbea");
  BakeCommand command;
  std::filesystem::path work;
  command.threads = 1;  // mpirun starts one rank per core
  declare(tool, command);
  tool.add_option("--work", work, "the work folder, on a file system that all ranks share")->required();
  return tool.run(argc, argv, [&] {
    catch_stop_signals();
    return bake_with(ranks, command, bake::WorkFolder(work));
  });
}
