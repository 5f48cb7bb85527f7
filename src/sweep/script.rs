//! Job scripts: the shards of a sweep as the tasks of a scheduler.

use std::{fmt, io, path::Path};

/// A scheduler.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
pub enum Scheduler {
    /// An array job of Slurm, for sbatch
    Slurm,
    /// A task array of HyperQueue, for hq submit
    #[cfg_attr(feature = "cli", value(name = "hyperqueue"))]
    HyperQueue,
    /// A shell script with GNU parallel, for one machine or, with --sshlogin, several
    GnuParallel,
}

/// Largest number of tasks that a script asks for by itself.
const TASKS: usize = 16;

/// A text as one word of a shell.
struct Quoted<'a>(&'a str);

impl fmt::Display for Quoted<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "'{}'", self.0.replace('\'', r"'\''"))
    }
}

/// The script that computes the sweep in `folder`.
///
/// * `cases`: number of cases
/// * `memory`: largest of a case \[bytes\]
///
/// # Errors
///
/// The path of the program or of the folder is not known.
pub fn script(scheduler: Scheduler, folder: &Path, cases: usize, memory: u64) -> io::Result<String> {
    let (program, folder) = (std::env::current_exe()?, std::path::absolute(folder)?);
    let (program, folder) = (program.to_string_lossy(), folder.to_string_lossy());
    let (program, directory) = (Quoted(&program), Quoted(&folder));
    let tasks = cases.clamp(1, TASKS);
    // room for the program and what it writes
    let megabytes = (memory >> 20) + 512;
    let merge = format!("{program} sweep {directory} --merge");
    let about = "A task computes one shard, writes its own journal, and goes on where it was stopped when it is run again.";
    Ok(match scheduler {
        Scheduler::Slurm => format!(
            "#!/bin/bash\n\
             #SBATCH --job-name=percuss-sweep\n\
             #SBATCH --array=1-{tasks}\n\
             #SBATCH --ntasks=1\n\
             #SBATCH --cpus-per-task=1\n\
             #SBATCH --mem={megabytes}M\n\
             #SBATCH --requeue\n\
             #SBATCH --open-mode=append\n\
             # {about}\n\
             # Another number of tasks: sbatch --array=1-100 SCRIPT. When all have ended:\n\
             #   {merge}\n\
             exec {program} sweep {directory} --quiet --threads \"$SLURM_CPUS_PER_TASK\" \\\n    \
             --shard \"$SLURM_ARRAY_TASK_ID/$SLURM_ARRAY_TASK_COUNT\"\n"
        ),
        Scheduler::HyperQueue => format!(
            "#!/bin/bash\n\
             #HQ --name percuss-sweep\n\
             #HQ --array 1-{tasks}\n\
             #HQ --cpus 1\n\
             # {about}\n\
             # When all have ended:\n\
             #   {merge}\n\
             exec {program} sweep {directory} --quiet --threads 1 --shard \"$HQ_TASK_ID/{tasks}\"\n"
        ),
        Scheduler::GnuParallel => format!(
            "#!/bin/bash\n\
             # {about}\n\
             seq {tasks} | parallel --quote {program} sweep {directory} --quiet --threads 1 --shard {{}}/{tasks} &&\n    \
             {merge}\n"
        ),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_words_of_the_shell() {
        assert_eq!(Quoted("it's a folder").to_string(), r"'it'\''s a folder'");
        let script = script(Scheduler::Slurm, "/a b".as_ref(), 5, 1 << 30).expect("a script");
        assert!(script.contains("--array=1-5\n") && script.contains("--mem=1536M\n"), "{script}");
        assert!(script.contains(" sweep '/a b' --quiet"), "{script}");
    }
}
