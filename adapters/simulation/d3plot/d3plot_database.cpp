#include "adapters/simulation/d3plot/d3plot_database.hpp"

#include "adapters/simulation/d3plot/d3plot_encoding.hpp"

namespace lbea::io::d3plot {

Database open_database(const std::filesystem::path& first_file) {
  WordFile file(first_file);
  if (!detect_encoding(file)) refuse_continuation(first_file);
  Database database;
  database.family = find_family(first_file);
  database.header = read_header(file);
  database.word_bytes = file.word_bytes();
  if (database.header.shells == 0 && database.header.solids == 0)
    file.refuse(Status::unsupported_input, 31,
                "the model has neither shells nor solids, so no surface to see (beams and thick shells are not "
                "read); give a run with a surface");
  database.geometry = read_geometry(file, database.header);
  database.layout = lay_out_state(file, database.header, database.geometry);
  database.states =
      index_states(database.family, database.word_bytes, database.geometry.end_word, database.layout.words);
  if (!database.states.empty() && !database.header.has_positions)
    file.refuse(Status::unsupported_input, 20,
                "the states hold no node positions (IU = 0), so no deformation; write the run with "
                "*DATABASE_BINARY_D3PLOT of the structural solver");
  return database;
}

StateFile::StateFile(const Database& database)
    : family_(database.family), file_(database.family.front(), database.word_bytes) {}

void StateFile::read(const StatePlace& place, std::uint64_t start, std::span<float> into) {
  if (place.file != open_) {
    file_ = WordFile(family_[place.file], file_.word_bytes());
    open_ = place.file;
  }
  file_.reals(place.word + start, into, "a state");
}

}  // namespace lbea::io::d3plot
