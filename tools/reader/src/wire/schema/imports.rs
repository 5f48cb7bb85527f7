//! Files that import each other.

use std::collections::HashMap;

use prost_reflect::prost_types::FileDescriptorProto;

use super::SchemaError;

/// Most ways over which files import each other publicly, counted once for each import.
const MAX_WAYS: usize = 1 << 14;
const MAX_TOTAL: usize = MAX_WAYS * 64;

/// Most files, which bounds the length of such a way.
const MAX_FILES: usize = 1 << 11;

/// Refuses files that import each other publicly in circles, or over so many ways that following them does not end.
pub(super) fn refuse_circles(files: &[FileDescriptorProto]) -> Result<(), SchemaError> {
    if files.len() > MAX_FILES {
        return Err(SchemaError::unsound(format!("it has more than {MAX_FILES} files")));
    }
    let by_name: HashMap<&str, usize> = files.iter().enumerate().map(|(i, file)| (file.name(), i)).collect();
    let mut ways = vec![Ways::Unknown; files.len()];
    let total = (0..files.len()).try_fold(0_usize, |total, file| {
        let of_file = count_ways(file, files, &by_name, &mut ways)?;
        let imports = files[file].dependency.len() + 1;
        Some(total.saturating_add(of_file.saturating_mul(imports))).filter(|total| *total <= MAX_TOTAL)
    });
    total
        .map(drop)
        .ok_or_else(|| SchemaError::unsound("its files import each other publicly in circles or too often"))
}

#[derive(Clone, Copy)]
enum Ways {
    Unknown,
    Open,
    Known(usize),
}

/// Number of ways that public imports lead from a file; `None` if one leads back, or there are too many.
fn count_ways(
    file: usize,
    files: &[FileDescriptorProto],
    by_name: &HashMap<&str, usize>,
    ways: &mut [Ways],
) -> Option<usize> {
    match ways[file] {
        Ways::Known(count) => return Some(count),
        Ways::Open => return None,
        Ways::Unknown => ways[file] = Ways::Open,
    }
    let mut count = 1_usize;
    for &public in &files[file].public_dependency {
        let name = usize::try_from(public).ok().and_then(|public| files[file].dependency.get(public));
        let import = name.and_then(|name| by_name.get(name.as_str()));
        if let Some(&import) = import {
            count = count.saturating_add(count_ways(import, files, by_name, ways)?);
        }
    }
    if count > MAX_WAYS {
        return None;
    }
    ways[file] = Ways::Known(count);
    Some(count)
}
