//! Job scripts: the shards of a sweep as the tasks of a scheduler.

use std::{io, path::Path};

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

/// A path as one word of a shell.
fn quoted(path: &Path) -> String {
    format!("'{}'", path.to_string_lossy().replace('\'', r"'\''"))
}

/// The part of a task of Slurm, whose indices may be any: the one at its place in a row of indices, else the first that no other task of the
/// array has. A task that is requeued finds the one that it had: links are made once, and by one task each.
const PART_OF_TASK: &str = r#"mkdir -p "$tasks" || exit
for part in $((SLURM_ARRAY_TASK_ID - SLURM_ARRAY_TASK_MIN + 1)) $(seq "$SLURM_ARRAY_TASK_COUNT"); do
    ((part <= SLURM_ARRAY_TASK_COUNT)) || continue
    ln -sn "$SLURM_ARRAY_TASK_ID" "$tasks/$part" 2>/dev/null
    [ "$(readlink "$tasks/$part")" != "$SLURM_ARRAY_TASK_ID" ] || break
done
"#;

/// The script that computes the sweep in `folder`.
///
/// * `cases`: number of cases
/// * `memory`: largest of a case \[bytes\]
pub fn script(scheduler: Scheduler, folder: &Path, cases: usize, memory: u64) -> io::Result<String> {
    let (program, directory) = (quoted(&std::env::current_exe()?), quoted(&std::path::absolute(folder)?));
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
             # Any other tasks: sbatch --array=0-99 SCRIPT, sbatch --array=3,7,11 SCRIPT. When all have ended:\n\
             #   {merge}\n\
             tasks={directory}/tasks-$SLURM_ARRAY_JOB_ID\n\
             {PART_OF_TASK}\
             exec {program} sweep {directory} --quiet --threads \"$SLURM_CPUS_PER_TASK\" \\\n    \
             --shard \"$part/$SLURM_ARRAY_TASK_COUNT\"\n"
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
        assert_eq!(quoted("it's a folder".as_ref()), r"'it'\''s a folder'");
        let script = script(Scheduler::Slurm, "/a b".as_ref(), 5, 1 << 30).expect("a script");
        assert!(script.contains("--array=1-5\n") && script.contains("--mem=1536M\n"), "{script}");
        assert!(script.contains(" sweep '/a b' --quiet"), "{script}");
    }
}
