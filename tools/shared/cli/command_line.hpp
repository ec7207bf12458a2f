// Options and subcommands of a program. Only command_line.cpp includes CLI11: it is a header-only library, which adds
// ten seconds to the compilation of each file that includes it.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

namespace CLI {
class App;
class Option;
class Validator;
}  // namespace CLI

namespace lbea::tool {

/// A condition on the text of an option, or a transformation of it, and its description in --help.
class Check {
 public:
  /// Returns the reason for a refusal, or an empty string; may replace the text (Option::transform).
  using Function = std::function<std::string(std::string& text)>;
  Check(Function function, std::string words);
  explicit Check(std::shared_ptr<const CLI::Validator> validator) : validator_(std::move(validator)) {}
  [[nodiscard]] const CLI::Validator& validator() const noexcept { return *validator_; }

 private:
  std::shared_ptr<const CLI::Validator> validator_;
};

/// Defined for int, unsigned, std::size_t, float and double. The limits are included.
template <class Number>
[[nodiscard]] Check in_range(Number least, Number most);
[[nodiscard]] Check positive_number();
[[nodiscard]] Check non_negative_number();
/// A shell passes an unset variable as an empty text.
[[nodiscard]] Check not_empty();
[[nodiscard]] Check existing_file();
[[nodiscard]] Check existing_folder();
[[nodiscard]] Check one_of(std::vector<std::string> names);

class Option {
 public:
  explicit Option(CLI::Option& option) : option_(&option) {}
  Option* required();
  Option* check(const Check& check);
  /// As check(); the transformed text is read in place of the original.
  Option* transform(const Check& check);
  Option* needs(const Option* other);
  Option* needs(const std::string& name);
  Option* excludes(const Option* other);
  Option* excludes(const std::string& name);
  /// The heading under which --help lists the option.
  Option* group(const std::string& heading);
  /// The default that --help shows.
  Option* default_text(const std::string& text);
  Option* delimiter(char between_values);
  Option* expected(int values);
  /// One value each time that the option is given.
  Option* repeatable();

 private:
  CLI::Option* option_;
};

/// The options of a program or of one of its subcommands. --help shows the values that the variables have when their
/// options are added.
class CommandLine {
 public:
  CommandLine(const std::string& program, const std::string& description, const std::string& footer);
  virtual ~CommandLine();
  CommandLine(const CommandLine&) = delete;
  CommandLine& operator=(const CommandLine&) = delete;

  /// Defined in command_line.cpp for numbers, strings, paths, std::optional and std::vector of them.
  template <class Value>
  requires(!std::is_enum_v<Value>) Option* add_option(const std::string& names, Value& value, const std::string& help);
  /// Accepts one of several names, each with its value. Variable: Enum or std::optional<Enum>.
  template <class Variable, class Enum>
  Option* add_choice(const std::string& names, Variable& value, const std::map<std::string, Enum>& choices,
                     const std::string& help);
  Option* add_option_function(const std::string& names, std::function<void(std::int64_t)> use, const std::string& help);
  Option* add_flag(const std::string& names, bool& value, const std::string& help);
  /// A flag that prints a text and ends the program; other options are ignored.
  void add_text_flag(const std::string& name, const std::string& text, const std::string& help);
  [[nodiscard]] Option* get_option(const std::string& name);

  CommandLine& add_subcommand(const std::string& name, const std::string& description);
  void require_subcommand();
  /// Whether this subcommand was given.
  [[nodiscard]] bool is_chosen() const;

  [[nodiscard]] const std::string& program() const noexcept { return program_; }
  /// Reads the command line. Returns CLI11's exit code when the program must end: 0 after --help and --version, another
  /// value after it has printed an error.
  [[nodiscard]] std::optional<int> parse(int argc, char** argv);

 private:
  explicit CommandLine(CLI::App& subcommand);
  Option* keep(CLI::Option* option);
  Option* add_name(const std::string& names, const std::vector<std::string>& choices, const std::string& default_name,
                   std::function<void(const std::string&)> use, const std::string& help);

  std::string program_;
  std::unique_ptr<CLI::App> owned_;
  CLI::App* app_;
  std::vector<std::unique_ptr<Option>> options_;
  std::vector<std::unique_ptr<CommandLine>> subcommands_;
};

template <class Variable, class Enum>
Option* CommandLine::add_choice(const std::string& names, Variable& value, const std::map<std::string, Enum>& choices,
                                const std::string& help) {
  std::vector<std::string> all;
  std::string default_name;
  for (const auto& [name, choice] : choices) {
    all.push_back(name);
    if (choice == value) default_name = name;
  }
  return add_name(
      names, all, default_name, [&value, choices](const std::string& name) { value = choices.at(name); }, help);
}

}  // namespace lbea::tool
