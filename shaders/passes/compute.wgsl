// Projection in a compute shader: a workgroup is a chunk.

fn project_lane(group: vec3<u32>, lane: u32, again: bool) {
    let chunk = group.y * GROUPS + group.x;
    if chunk >= frame.chunk_count {
        return;
    }
    let job = job_of(chunk, lane, 0u);
    if !job.exists {
        return;
    }
    let place = vec3(surfel_x[job.surfel], surfel_y[job.surfel], surfel_z[job.surfel]);
    let q = place - row(job.camera + V1).xyz;
    let images = images_of(job.camera, q, job.lambda);
    var valid = false;
    for (var piece = 0u; piece < images.pieces.count; piece++) {
        let image = project(job.camera, images, piece);
        if !image.found {
            continue;
        }
        if frame.counts != 0u && !again {
            valid = valid || is_valid(job.camera, image);
        }
        let s = splat_of(job, image);
        if s.drawn {
            cover(s, again);
        }
        if frame.first_root != 0u && is_seen(job.camera, image) {
            break;
        }
    }
    if valid {
        count_valid();
    }
}

@compute @workgroup_size(64)
fn project_chunk(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    project_lane(group, lane, false);
}

@compute @workgroup_size(64)
fn project_chunk_again(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    project_lane(group, lane, true);
}
