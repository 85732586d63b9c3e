#include <sys/wait.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <map>

#include "client_lib/recording/signals.h"
#include "client_lib/tools/takt/commands.h"
#include "idl/command_line/numbers.h"
#include "idl/common/parse.h"
#include "idl/common/text.h"

namespace takt::tool {
namespace {

struct ExportOptions {
  std::string file, csv;
  std::vector<std::string> signals;
  bool list = false;
};

struct PlotOptions {
  std::string file, output;
  std::vector<std::string> signals;
  std::string size = "1200,700";
};

using recording::McapReader;
using recording::SignalSample;

McapReader open(const std::string& file) {
  McapReader reader(file);
  if (!reader.cut_off().empty()) std::fprintf(stderr, "takt: note: %s\n", reader.cut_off().c_str());
  return reader;
}

/// Throws if both paths, links followed, are the same file: opening it for writing would empty the recording.
void refuse_recording_itself(const std::string& recording, const std::filesystem::path& output) {
  std::error_code not_there;
  if (std::filesystem::equivalent(recording, output, not_there))
    throw std::runtime_error("'" + output.string() + "' is the recording itself; it is not written over.");
}

/// During its lifetime, writing into a pipe without a reader returns an error and raises no signal.
class BrokenPipesAreErrors {
 public:
  BrokenPipesAreErrors() : before_(std::signal(SIGPIPE, SIG_IGN)) {}
  ~BrokenPipesAreErrors() { std::signal(SIGPIPE, before_); }
  BrokenPipesAreErrors(const BrokenPipesAreErrors&) = delete;
  BrokenPipesAreErrors& operator=(const BrokenPipesAreErrors&) = delete;

 private:
  void (*before_)(int);
};

/// Throws with the reason when there is no picture afterwards.
void draw(const std::string& script, const std::filesystem::path& picture) {
  const BrokenPipesAreErrors guard;
  std::FILE* gnuplot = popen("gnuplot", "w");
  if (gnuplot == nullptr) throw std::runtime_error("gnuplot cannot be started.");
  const bool written = std::fwrite(script.data(), 1, script.size(), gnuplot) == script.size();
  const int status = pclose(gnuplot);
  constexpr int kNotFound = 127;  // of the shell
  if (WIFEXITED(status) && WEXITSTATUS(status) == kNotFound)
    throw std::runtime_error("gnuplot, which draws pictures, is not installed (Debian package gnuplot-nox).");
  if (status != 0 || !written) throw std::runtime_error("gnuplot could not draw '" + picture.string() + "'.");
}

[[noreturn]] void no_signal(McapReader& reader, const std::vector<std::string>& patterns) {
  std::string sentence = "'" + reader.file().string() + "' has no signal";
  for (const std::string& pattern : patterns)
    sentence += (&pattern == &patterns[0] ? " '" : ", '") + pattern + "'";
  throw std::runtime_error(sentence + "; 'takt export " + reader.file().string() +
                           " --list' shows what there is.");
}

/// A row for every state, with what was newest of everything else; a column for every signal.
class CsvTable {
 public:
  CsvTable(const std::string& file, std::vector<std::string> columns)
      : name_(file),
        to_stdout_(file == "-"),
        columns_(std::move(columns)),
        row_(columns_.size(), std::nan("")) {
    if (!to_stdout_) {
      out_.open(file);
      if (!out_) throw std::runtime_error("The file '" + file + "' cannot be written.");
    }
    for (std::size_t i = 0; i < columns_.size(); ++i) place_[columns_[i]] = i;
    std::string line = "time,epoch";
    for (const std::string& column : columns_) line += "," + column;
    write(line);
  }
  void add(const SignalSample& sample) {
    // Samples of an instant follow its state, or all samples are of one topic.
    const bool begins_row = row_topic_.empty() || sample.topic == row_topic_;
    if (begins_row) {
      if (!row_topic_.empty()) end_row();
      row_topic_ = sample.topic;
      time_s_ = sample.time_s;
      epoch_ = sample.epoch;
    }
    for (const auto& [name, value] : sample.values) row_[place_.at(name)] = value;
  }
  std::uint64_t finish() {
    if (!row_topic_.empty()) end_row();
    if (!to_stdout_) {
      out_.close();
      if (!out_) throw std::runtime_error("The file '" + name_ + "' cannot be written on.");
    }
    return rows_;
  }
  /// The topic whose samples make the rows.
  void rows_by(const std::string& topic) { wanted_topic_ = topic; }
  bool starts(const SignalSample& sample) const {
    return wanted_topic_.empty() || !row_topic_.empty() || sample.topic == wanted_topic_;
  }

 private:
  void write(const std::string& line) {
    if (to_stdout_)
      std::printf("%s\n", line.c_str());
    else
      out_ << line << '\n';
  }
  void end_row() {
    std::string line = number_text(time_s_, 12) + "," + std::to_string(epoch_);
    for (const double value : row_)
      line += "," + (std::isnan(value) ? std::string() : number_text(value, 12));
    write(line);
    ++rows_;
  }

  std::string name_;
  bool to_stdout_;
  std::ofstream out_;
  std::vector<std::string> columns_;
  std::map<std::string, std::size_t> place_;
  std::vector<double> row_;
  std::string row_topic_, wanted_topic_;
  double time_s_ = 0.0;
  std::uint32_t epoch_ = 0;
  std::uint64_t rows_ = 0;
};

int list_contents(const Common& common, McapReader& reader, const std::vector<std::string>& patterns) {
  const auto names = recording::signal_names(reader, patterns);
  if (common.json) {
    nlohmann::json document{{"file", reader.file().string()},
                            {"profile", reader.profile()},
                            {"complete", reader.cut_off().empty()},
                            {"chunks", reader.chunk_count()},
                            {"duration", 1e-9 * static_cast<double>(reader.last_ns() - reader.first_ns())},
                            {"signals", names}};
    for (const auto& [number, channel] : reader.channels())
      document["topics"].push_back({{"topic", channel.topic}, {"type", channel.type}});
    print_json(document, 2);
    return kOk;
  }
  for (const auto& name : names) std::printf("%s\n", name.c_str());
  return kOk;
}

int export_json(McapReader& reader) {
  recording::JsonSamples samples(reader.types());
  recording::with_first_description(reader, [&](const recording::McapMessage& message) {
    (void)samples.read(message.channel->type, message.sample);
  });
  reader.read([&](const recording::McapMessage& message) {
    if (message.channel->encoding != "cdr" || reader.types().find(message.channel->type) == nullptr)
      return true;
    recording::Json line{{"topic", message.channel->topic},
                         {"type", message.channel->type},
                         {"log_time_ns", message.log_time_ns},
                         {"publish_time_ns", message.publish_time_ns}};
    line["sample"] = samples.read(message.channel->type, message.sample);
    print_json(line);
    return true;
  });
  return kOk;
}

int export_recording(const Common& common, const ExportOptions& options) {
  McapReader reader = open(options.file);
  const std::vector<std::string> everything{"*"}, instants{"state.*", "power.*", "contacts.*"};
  if (options.list)
    return list_contents(common, reader, options.signals.empty() ? everything : options.signals);
  if (options.csv.empty()) {
    if (common.json) return export_json(reader);
    throw std::runtime_error("Into what? --csv FILE, --json, or --list for the signals there are.");
  }
  refuse_recording_itself(options.file, options.csv);
  const auto& patterns = options.signals.empty() ? instants : options.signals;
  std::vector<std::string> names = recording::signal_names(reader, patterns);
  if (names.empty()) no_signal(reader, patterns);
  const bool has_state = names.end() != std::find_if(names.begin(), names.end(), [](const std::string& name) {
                           return name.starts_with("state.");
                         });
  CsvTable table(options.csv, names);
  if (has_state) table.rows_by("state");
  recording::read_signals(reader, patterns, [&](const SignalSample& sample) {
    if (table.starts(sample)) table.add(sample);
  });
  const std::uint64_t rows = table.finish();
  if (common.json && options.csv != "-")
    print_json(nlohmann::json{{"file", options.csv}, {"rows", rows}, {"signals", names}});
  else
    std::fprintf(stderr, "%llu rows of %zu signals.\n", static_cast<unsigned long long>(rows), names.size());
  return kOk;
}

int plot(const Common& common, const PlotOptions& options) {
  const std::filesystem::path output = options.output.empty()
                                           ? std::filesystem::path(options.file).replace_extension(".png")
                                           : std::filesystem::path(options.output);
  const std::string kind = output.extension().string();
  if (kind != ".png" && kind != ".svg")
    throw std::runtime_error("The picture '" + output.string() + "' must end in .png or .svg.");
  const std::filesystem::path folder = output.parent_path();
  if (!folder.empty() && !std::filesystem::is_directory(folder))
    throw std::runtime_error("The folder '" + folder.string() + "' for the picture is not there.");
  refuse_recording_itself(options.file, output);
  McapReader reader = open(options.file);
  struct Curve {
    std::string points;
    double newest_s = -1.0e300;
  };
  std::vector<std::string> order;
  std::map<std::string, Curve> curves;
  recording::read_signals(reader, options.signals, [&](const SignalSample& sample) {
    for (const auto& [name, value] : sample.values) {
      const auto [curve, is_new] = curves.try_emplace(name);
      if (is_new) order.push_back(name);
      if (sample.time_s < curve->second.newest_s) curve->second.points += '\n';  // a reset: a new line begins
      if (sample.time_s == curve->second.newest_s) continue;                     // the instant was repeated
      curve->second.newest_s = sample.time_s;
      curve->second.points += number_text(sample.time_s, 12) + " " + number_text(value, 12) + "\n";
    }
  });
  if (order.empty()) no_signal(reader, options.signals);
  constexpr std::size_t kMaxCurves = 40;
  if (order.size() > kMaxCurves)
    throw std::runtime_error(std::to_string(order.size()) + " signals fit; a picture shows at most " +
                             std::to_string(kMaxCurves) + ". 'takt export " + options.file +
                             " --list' shows their names.");
  const auto quoted = [](std::string text) {
    for (std::size_t i = 0; i < text.size(); ++i)
      if (text[i] == '\'') text.insert(i++, 1, '\'');
    return "'" + text + "'";
  };
  std::string script = "set terminal " + std::string(kind == ".png" ? "pngcairo" : "svg") + " size " +
                       options.size + " noenhanced\nset output " + quoted(output.string()) +
                       "\nset xlabel 'simulated time [s]'\nset grid\nset key outside below\nplot ";
  for (const std::string& name : order)
    script += (name == order.front() ? "'-' using 1:2 with lines lw 1.5 title "
                                     : ", '-' using 1:2 with lines lw 1.5 title ") +
              quoted(name);
  script += "\n";
  for (const std::string& name : order) script += curves[name].points + "e\n";
  draw(script, output);
  if (common.json)
    print_json(nlohmann::json{{"picture", output.string()}, {"signals", order}});
  else
    std::printf("%s: %zu signals\n", output.string().c_str(), order.size());
  return kOk;
}

}  // namespace

void declare_recordings(CLI::App& app, const Common& common, int& result) {
  static ReplayOptions replay_options;
  auto* replay_command =
      app.add_subcommand("replay", "send the samples of a recording again, with their timing");
  replay_command->add_option("FILE", replay_options.file, "recording (MCAP)")
      ->required()
      ->check(CLI::ExistingFile);
  replay_command->add_option("--rate", replay_options.rate, "times as fast as recorded")
      ->check(command_line::positive())
      ->capture_default_str();
  replay_command->add_flag("--commands", replay_options.commands,
                           "commands that controllers sent too: a server that runs would follow them");
  replay_command->callback([&] { result = replay(common, replay_options); });

  static ExportOptions export_options;
  auto* export_command = app.add_subcommand("export", "a recording as a table, or as JSON");
  export_command->add_option("FILE", export_options.file, "recording (MCAP)")
      ->required()
      ->check(CLI::ExistingFile);
  export_command->add_option("--csv", export_options.csv,
                             "table to write, a row for every state; '-' is standard output");
  export_command->add_option("--signals", export_options.signals,
                             "only these (* for any characters); default: state.* power.* contacts.*");
  export_command->add_flag("--list", export_options.list, "names of the signals there are");
  export_command->callback([&] { result = export_recording(common, export_options); });

  static PlotOptions plot_options;
  auto* plot_command = app.add_subcommand("plot", "curves of a recording as PNG or SVG");
  plot_command->add_option("FILE", plot_options.file, "recording (MCAP)")
      ->required()
      ->check(CLI::ExistingFile);
  plot_command
      ->add_option("SIGNAL", plot_options.signals,
                   "names of signals, * for any characters; takt export FILE --list shows them")
      ->required();
  plot_command->add_option("-o,--output", plot_options.output,
                           "picture (.png, .svg); default: FILE with .png");
  plot_command->add_option("--size", plot_options.size, "width,height of the picture, in pixels")
      ->check([](const std::string& text) {
        const auto size = separated_numbers(text, ",");
        const auto pixels = [](double n) { return n >= 1.0 && n < 1e5 && n == std::floor(n); };
        return size && std::ranges::all_of(*size, pixels)
                   ? std::string()
                   : "found '" + text + "'; allowed: WIDTH,HEIGHT, e.g. 1200,700";
      })
      ->capture_default_str();
  plot_command->callback([&] { result = plot(common, plot_options); });
}

}  // namespace takt::tool
