/* A program by a compiler with MSVC's ABI and without a C library, for check_archive.sh: prints the layout of the
 * structs and what some functions of both DLLs return. Any compiler for Windows makes a program of it that prints the
 * same. */
#include <lbea/lbea.h>
#include <lbea/wire.h>

__declspec(dllimport) void* __stdcall GetStdHandle(unsigned long which);
__declspec(dllimport) int __stdcall WriteFile(void* file, const void* bytes, unsigned long count,
                                              unsigned long* written, void* place);
__declspec(dllimport) void __stdcall ExitProcess(unsigned code);

int _fltused; /* what MSVC's programs with floating point refer to */

static void print(const char* text) {
  unsigned long length = 0, written;
  while (text[length] != 0) ++length;
  WriteFile(GetStdHandle((unsigned long)-11), text, length, &written, NULL);
}

static void print_number(const char* name, size_t number) {
  char digits[24] = {0};
  char* first = digits + sizeof digits - 1;
  do *--first = (char)('0' + number % 10);
  while ((number /= 10) > 0);
  print(name);
  print(" ");
  print(first);
  print("\n");
}

/* The end of the last member tells the offset of every one before it, as do their sizes. */
#define PRINT(type, last)            \
  print_number(#type, sizeof(type)); \
  print_number(#type "." #last, offsetof(type, last) + sizeof(((type*)0)->last));

static void print_layouts(void) {
  PRINT(lbea_point, z)
  PRINT(lbea_frame, point_count)
  PRINT(lbea_match, time_s)
  PRINT(lbea_weighted_sample, weight)
  PRINT(lbea_channel_value, bound_90)
  PRINT(lbea_config, T_reference_sensor)
  PRINT(lbea_result, channels)
  PRINT(lbea_rig, clock_offset_ns)
  PRINT(lbea_rig_result, test_time_sd)
  PRINT(lbea_test_state, verdict)
  PRINT(lbea_parameter_forecast, is_identifiable)
  PRINT(lbea_channel_forecast, final_bound_90)
  PRINT(lbea_forecast_state, channels)
  PRINT(lbea_model_info, has_forecast)
  PRINT(lbea_field_info, largest_error)
  PRINT(lbea_wire_options, key_file)
  PRINT(lbea_wire_tally, handed_over)
  PRINT(lbea_wire_match, distance)
  PRINT(lbea_wire_candidate, residual)
  PRINT(lbea_wire_share, weight)
  PRINT(lbea_wire_channel, end_bound_90)
  PRINT(lbea_wire_rig_frame, clock_correction_ns)
  PRINT(lbea_wire_result, component)
  PRINT(lbea_wire_chance, probability)
  PRINT(lbea_wire_test, branch_probabilities)
  PRINT(lbea_wire_account, damaged)
  PRINT(lbea_wire_receipt, withheld)
  PRINT(lbea_wire_matcher, samples)
}

static void call_lbea(void) {
  static lbea_config config;
  lbea_model* model = NULL;
  print_number("version", lbea_version());
  print_number("config", (size_t)lbea_config_init(&config, sizeof config));
  print_number("max_matches", config.max_matches);
  print_number("model", (size_t)lbea_model_open("no such file", &model));
  print(lbea_last_error());
  print("\n");
}

static void call_wire(void) {
  static lbea_wire_options options;
  lbea_wire_sender* sender = NULL;
  options.struct_size = sizeof options;
  options.patience_ms = 1;
  print_number("version", lbea_wire_version());
  print_number("sender", (size_t)lbea_wire_sender_open("tcp://127.0.0.1:1", &options, &sender));
  print(lbea_wire_last_error());
  print("\n");
}

void start(void) {
  print_layouts();
  call_lbea();
  call_wire();
  ExitProcess(0);
}
