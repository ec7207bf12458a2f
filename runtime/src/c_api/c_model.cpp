// The C interface to models.
#include "runtime/src/c_api/c_support.hpp"

#include <lbea/forecast.hpp>

using namespace lbea;

namespace {
// Sizes of the structs in the first version that had them: every caller knows at least these fields.
constexpr std::size_t least_model_info = offsetof(lbea_model_info, length_unit) + sizeof(char*);
constexpr std::size_t least_field_info = offsetof(lbea_field_info, unit) + sizeof(char*);

/// `open` returns the Model, which it reads from `source`.
template <typename Open>
lbea_status open_model(const void* source, lbea_model** model, Open&& open) noexcept {
  if (model == nullptr) return bad_argument("lbea_model_open: model is NULL; give the address of a pointer");
  *model = nullptr;
  if (source == nullptr)
    return bad_argument("lbea_model_open: the path or image is NULL; give a file's name or a model's bytes");
  return guarded([&] {
    *model = new lbea_model(open());
    return LBEA_OK;
  });
}

std::filesystem::path path_of(const char* utf8) {
  try {
    return reinterpret_cast<const char8_t*>(utf8);
  } catch (const std::system_error&) {  // on Windows, where paths are UTF-16
    throw Error(Status::file_not_found, std::string(utf8) + ": this path is not UTF-8; convert it");
  }
}
}  // namespace

lbea_status lbea_model_open(const char* path, lbea_model** model) {
  return open_model(path, model, [&] { return Model::open(path_of(path)); });
}

lbea_status lbea_model_open_memory(const void* image, size_t size, lbea_model** model) {
  return open_model(image, model, [&] { return Model::view({static_cast<const std::byte*>(image), size}); });
}

void lbea_model_close(lbea_model* model) { delete model; }

lbea_status lbea_model_get_info(const lbea_model* model, lbea_model_info* info) {
  if (model == nullptr || info == nullptr) return bad_argument("lbea_model_get_info: model or info is NULL");
  if (!is_plausible_size(info->struct_size, least_model_info)) return bad_argument(size_not_set);
  const Model& m = model->model;
  write_c_struct({0, m.vertices(), m.modes(), m.samples(), m.simulations(), m.references(), m.nodes(), m.elements(),
                  m.fields(), m.checksum(), model->length_unit.c_str(), m.parameters(), Forecast::is_in(m) ? 1 : 0},
                 info);
  return LBEA_OK;
}

lbea_status lbea_model_get_field(const lbea_model* model, uint32_t field, lbea_field_info* info) {
  if (model == nullptr || info == nullptr) return bad_argument("lbea_model_get_field: model or info is NULL");
  if (!is_plausible_size(info->struct_size, least_field_info)) return bad_argument(size_not_set);
  const Model& m = model->model;
  if (field >= m.fields())
    return bad_argument("lbea_model_get_field: no such field; give less than lbea_model_info.fields");
  const auto& [name, unit] = model->fields[field];
  write_c_struct({0, m.field_size(field), name.c_str(), unit.c_str(), m.field(field).largest_error}, info);
  return LBEA_OK;
}

uint32_t lbea_model_channel_count(const lbea_model* model) { return model == nullptr ? 0 : model->model.channels(); }

const char* lbea_model_channel_name(const lbea_model* model, uint32_t channel) {
  return channel < lbea_model_channel_count(model) ? model->channels[channel].first.c_str() : nullptr;
}

const char* lbea_model_channel_unit(const lbea_model* model, uint32_t channel) {
  return channel < lbea_model_channel_count(model) ? model->channels[channel].second.c_str() : nullptr;
}

const char* lbea_model_simulation_name(const lbea_model* model, uint32_t simulation) {
  if (model == nullptr || simulation >= model->simulation_names.size()) return nullptr;
  return model->simulation_names[simulation].c_str();
}

const char* lbea_model_parameter_name(const lbea_model* model, uint32_t parameter) {
  if (model == nullptr || parameter >= model->parameter_names.size()) return nullptr;
  return model->parameter_names[parameter].c_str();
}

const float* lbea_model_node_positions(const lbea_model* model, uint32_t sample) {
  if (model == nullptr || sample >= model->model.samples()) return nullptr;
  return model->model.node_positions(sample).data();
}

const float* lbea_model_field_values(const lbea_model* model, uint32_t field, uint32_t sample) {
  if (model == nullptr || field >= model->model.fields() || sample >= model->model.samples()) return nullptr;
  return model->model.field_values(field, sample).data();
}

lbea_status lbea_model_read_field(const lbea_model* model, uint32_t field, uint32_t sample, float* values,
                                  size_t count) {
  if (model == nullptr || values == nullptr) return bad_argument("lbea_model_read_field: model or values is NULL");
  const Model& m = model->model;
  if (field >= m.fields() || sample >= m.samples())
    return bad_argument("lbea_model_read_field: no such field or sample");
  if (count < m.field_size(field))
    return bad_argument("lbea_model_read_field: too little room; give lbea_field_info.values_per_sample");
  m.read_field(field, sample, {values, m.field_size(field)});
  return LBEA_OK;
}
