# A Slurm for tests/schedulers/run, which reads this file: a controller and two nodes of one core each, n1 and n2, all on this machine.
# Its files are in the folder $slurm, and whatever it starts has SLURM_CONF in its environment: so it is found again.

slurm_start() {
    export SLURM_CONF=$slurm/slurm.conf
    mkdir -p "$slurm"/{state,munge}
    local host ports
    host=$(hostname -s)
    # free ones: controller, nodes
    ports=($(python3 -c 'import socket
sockets = [socket.create_server(("127.0.0.1", 0)) for _ in range(3)]
print(*(s.getsockname()[1] for s in sockets))'))
    # cred_expire is also the time that a requeued task waits
    cat >"$SLURM_CONF" <<CONF
ClusterName=percuss
SlurmctldHost=$host(127.0.0.1)
SlurmctldPort=${ports[0]}
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
AuthInfo=socket=$slurm/munge/socket,cred_expire=5
CredType=cred/munge
StateSaveLocation=$slurm/state
SlurmdSpoolDir=$slurm/spool.%n
SlurmctldPidFile=$slurm/slurmctld.pid
SlurmdPidFile=$slurm/%n.pid
SlurmctldLogFile=$slurm/slurmctld.log
SlurmdLogFile=$slurm/%n.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
MpiDefault=none
SchedulerType=sched/backfill
SchedulerParameters=bf_interval=1,sched_interval=1
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
ReturnToService=2
NodeName=n1 NodeHostname=$host NodeAddr=127.0.0.1 Port=${ports[1]} CPUs=1 RealMemory=1000
NodeName=n2 NodeHostname=$host NodeAddr=127.0.0.1 Port=${ports[2]} CPUs=1 RealMemory=1000
PartitionName=all Nodes=ALL Default=YES MaxTime=INFINITE State=UP
CONF
    head -c 1024 /dev/urandom >"$slurm/munge/key"
    chmod 400 "$slurm/munge/key"
    chown -R munge "$slurm/munge"
    setpriv --reuid munge --regid munge --clear-groups munged --force --key-file="$slurm/munge/key" \
        --socket="$slurm/munge/socket" --pid-file="$slurm/munge/pid" --log-file="$slurm/munge/log" --seed-file="$slurm/munge/seed"
    slurmctld
    slurmd -N n1
    slurmd -N n2
    wait_for 30 'two idle nodes' eval 'test "$(sinfo -h -N -t idle -o %N | wc -l)" -eq 2'
}

# All processes of this Slurm: daemons, tasks, and those that watch tasks.
slurm_processes() {
    env -u SLURM_CONF grep -slzxF "SLURM_CONF=$slurm/slurm.conf" /proc/[0-9]*/environ | cut -d/ -f3 || true
}

# Ends a node and all that runs on it at once, as a failure of its power does. Afterwards the node may be started again.
slurm_crash() {
    local process parent tasks=() watchers=()
    kill -9 "$(cat "$slurm/$1.pid")"
    for process in $(slurm_processes); do
        grep -qszxF "SLURMD_NODENAME=$1" "/proc/$process/environ" || continue
        tasks+=("$process")
        parent=$(awk '/^PPid:/ { print $2 }' "/proc/$process/status")
        if grep -qsx slurmstepd "/proc/$parent/comm"; then watchers+=("$parent"); fi
    done
    # those first that would report the end of the others
    kill -9 "${watchers[@]}" "${tasks[@]}"
}

# Ends everything.
slurm_stop() {
    local processes
    while processes=$(slurm_processes) && [ "$processes" ]; do
        xargs kill -9 <<<"$processes" 2>/dev/null || true
    done
}
