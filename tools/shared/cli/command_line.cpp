#include "tools/shared/cli/command_line.hpp"

#include "adapters/files/file_names.hpp"
#include "tools/shared/system/process.hpp"

#include <lbea/version.hpp>

#include <CLI/CLI.hpp>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <limits>
#include <string_view>

namespace lbea::tool {
namespace {

/// CLI11 reads 010 as octal, and clamps numbers that do not fit.
bool is_decimal_integer(std::string_view text, bool is_signed) {
  const std::string_view digits = text.substr(text.starts_with('-') || text.starts_with('+') ? 1 : 0);
  if (digits.size() > 1 && digits.starts_with('0')) return false;
  const char* const end = digits.data() + digits.size();
  std::int64_t within = 0;
  std::uint64_t value = 0;
  if (is_signed && text.starts_with('-'))
    return std::from_chars(text.data(), end, within) == std::from_chars_result{end, std::errc{}};
  const auto [read, error] = std::from_chars(digits.data(), end, value);
  return read == end && error == std::errc{} &&
         (!is_signed || value <= std::uint64_t{std::numeric_limits<std::int64_t>::max()});
}

/// CLI11's ranges accept NaN.
void check_numbers(const CLI::App& app) {
  for (const CLI::Option* option : app.get_options()) {
    const std::string type = option->get_type_name();
    for (const std::string& text : option->results()) {
      if (double value = 0;
          type.starts_with("FLOAT") && CLI::detail::lexical_cast(text, value) && !std::isfinite(value))
        throw CLI::ValidationError(option->get_name(), "\"" + text + "\" is not a finite number");
      if ((type.starts_with("INT") || type.starts_with("UINT")) && !is_decimal_integer(text, type.starts_with("INT")))
        throw CLI::ValidationError(
            option->get_name(), "\"" + text + "\" is not a whole number that fits, in decimals without leading zeros");
    }
  }
  for (const CLI::App* command : app.get_subcommands()) check_numbers(*command);
}

/// CLI11 writes {false} behind flags that set false.
class HelpFormatter : public CLI::Formatter {
 public:
  std::string make_option_name(const CLI::Option* option, bool is_positional) const override {
    constexpr std::string_view value = "{false}";
    std::string name = CLI::Formatter::make_option_name(option, is_positional);
    for (std::size_t at = name.find(value); at != std::string::npos; at = name.find(value))
      name.erase(at, value.size());
    return name;
  }
};

/// which: in the refusal; name: in the help.
Check number(bool (*is_allowed)(double), const std::string& which, const std::string& name) {
  return Check(
      [is_allowed, which](const std::string& text) {
        double value = 0;
        return CLI::detail::lexical_cast(text, value) && is_allowed(value) ? "" : text + " is not a number " + which;
      },
      name);
}

}  // namespace

Check::Check(Function function, std::string words)
    : validator_(std::make_shared<CLI::Validator>(std::move(function), std::move(words))) {}

template <class Number>
Check in_range(Number least, Number most) {
  return Check(std::make_shared<CLI::Range>(least, most));
}
template Check in_range(int, int);
template Check in_range(unsigned, unsigned);
template Check in_range(std::size_t, std::size_t);
template Check in_range(float, float);
template Check in_range(double, double);

Check positive_number() {
  return number([](double value) { return value > 0; }, "greater than 0", "POSITIVE");
}
Check non_negative_number() {
  return number([](double value) { return value >= 0; }, "of at least 0", "NONNEGATIVE");
}
Check not_empty() {
  return Check(
      [](const std::string& text) { return text.empty() ? "is empty; is a variable of the shell unset?" : ""; }, "");
}
Check existing_file() { return Check(std::make_shared<CLI::Validator>(CLI::ExistingFile)); }
Check existing_folder() { return Check(std::make_shared<CLI::Validator>(CLI::ExistingDirectory)); }
Check one_of(std::vector<std::string> names) { return Check(std::make_shared<CLI::IsMember>(std::move(names))); }

Option* Option::required() { return option_->required(), this; }
Option* Option::check(const Check& check) { return option_->check(check.validator()), this; }
Option* Option::transform(const Check& check) { return option_->transform(check.validator()), this; }
Option* Option::needs(const Option* other) { return option_->needs(other->option_), this; }
Option* Option::needs(const std::string& name) { return option_->needs(name), this; }
Option* Option::excludes(const Option* other) { return option_->excludes(other->option_), this; }
Option* Option::excludes(const std::string& name) { return option_->excludes(name), this; }
Option* Option::group(const std::string& heading) { return option_->group(heading), this; }
Option* Option::default_text(const std::string& text) { return option_->default_str(text), this; }
Option* Option::delimiter(char between_values) { return option_->delimiter(between_values), this; }
Option* Option::expected(int values) { return option_->expected(values), this; }
Option* Option::repeatable() { return option_->allow_extra_args(false), this; }

CommandLine::CommandLine(const std::string& program, const std::string& description, const std::string& footer)
    : program_(program), owned_(std::make_unique<CLI::App>(description, program)), app_(owned_.get()) {
  app_->set_version_flag("--version", program + " " LBEA_VERSION_STRING);
  app_->footer(footer);
  app_->formatter(std::make_shared<HelpFormatter>());  // subcommands inherit it
  app_->allow_windows_style_options(false);            // "/data" is a path
  app_->option_defaults()->always_capture_default();
}

CommandLine::CommandLine(CLI::App& subcommand) : program_(subcommand.get_name()), app_(&subcommand) {
  app_->option_defaults()->always_capture_default();
}

CommandLine::~CommandLine() = default;

std::optional<int> CommandLine::parse(int argc, char** argv) {
  auto arguments = arguments_of(argc, argv);
  std::ranges::reverse(arguments);  // as CLI11 wants them
  try {
    app_->parse(std::move(arguments));
    check_numbers(*app_);
  } catch (const CLI::ParseError& error) { return app_->exit(error); }
  return std::nullopt;
}

CommandLine& CommandLine::add_subcommand(const std::string& name, const std::string& description) {
  return *subcommands_.emplace_back(new CommandLine(*app_->add_subcommand(name, description)));
}

void CommandLine::require_subcommand() { app_->require_subcommand(1); }
bool CommandLine::is_chosen() const { return app_->parsed(); }

void CommandLine::add_text_flag(const std::string& name, const std::string& text, const std::string& help) {
  app_->add_flag_callback(
      name, [text] { throw CLI::CallForVersion(text, CLI::ExitCodes::Success); }, help);
}

Option* CommandLine::keep(CLI::Option* option) {
  return options_.emplace_back(std::make_unique<Option>(*option)).get();
}

template <class Value>
requires(!std::is_enum_v<Value>) Option* CommandLine::add_option(const std::string& names, Value& value,
                                                                 const std::string& help) {
  if constexpr (std::is_same_v<Value, std::filesystem::path>) {
    const auto use = [&value](const std::string& name) { value = io::path_of(name); };
    return keep(app_->add_option_function<std::string>(names, use, help)->default_str(value.string()));
  } else {
    return keep(app_->add_option(names, value, help));
  }
}

// The types of values that the programs' options have.
#define LBEA_ONE(...) template Option* CommandLine::add_option(const std::string&, __VA_ARGS__&, const std::string&);
#define LBEA_OPTION(Type) LBEA_ONE(Type) LBEA_ONE(std::optional<Type>) LBEA_ONE(std::vector<Type>)
LBEA_ONE(std::optional<bool>)
LBEA_OPTION(int)
LBEA_OPTION(std::int64_t)
LBEA_OPTION(std::uint32_t)
LBEA_OPTION(std::uint64_t)
LBEA_OPTION(float)
LBEA_OPTION(double)
LBEA_OPTION(std::string)
LBEA_OPTION(std::filesystem::path)
#undef LBEA_OPTION
#undef LBEA_ONE

Option* CommandLine::add_option_function(const std::string& names, std::function<void(std::int64_t)> use,
                                         const std::string& help) {
  return keep(app_->add_option_function<std::int64_t>(names, std::move(use), help));
}

Option* CommandLine::add_flag(const std::string& names, bool& value, const std::string& help) {
  return keep(app_->add_flag(names, value, help));
}

Option* CommandLine::get_option(const std::string& name) { return keep(app_->get_option(name)); }

Option* CommandLine::add_name(const std::string& names, const std::vector<std::string>& choices,
                              const std::string& default_name, std::function<void(const std::string&)> use,
                              const std::string& help) {
  CLI::Option* option = app_->add_option_function<std::string>(names, std::move(use), help);
  return keep(option->check(CLI::IsMember(choices))->default_str(default_name));
}

}  // namespace lbea::tool
