//! The messages of a recording, generated from `schemas/*.proto` by `tests/schemas.rs`, and their descriptors.

use std::sync::LazyLock;

use prost::Message;
use prost_types::{FileDescriptorProto, FileDescriptorSet};

/// Messages of package `percuss`.
#[expect(missing_docs, reason = "generated; the comments of the .proto files are the documentation")]
pub mod percuss {
    include!("message/percuss.rs");
}

/// Messages of package `foxglove`: the published schemas that viewers know.
#[expect(missing_docs, reason = "generated; the comments of the .proto files are the documentation")]
pub mod foxglove {
    include!("message/foxglove.rs");
}

static DESCRIPTORS: LazyLock<FileDescriptorSet> = LazyLock::new(|| {
    let bytes = include_bytes!("../schemas/descriptors.binpb");
    FileDescriptorSet::decode(bytes.as_slice()).expect("a descriptor set is embedded")
});

/// Serialised `FileDescriptorSet` of one message: its file and everything that file imports, imports first.
///
/// * `name`: full name, `package.Message`
///
/// # Panics
///
/// If there is no such message: names are constants of this crate.
pub fn descriptor_set(name: &str) -> Vec<u8> {
    let defines = |file: &&FileDescriptorProto| {
        file.message_type.iter().any(|message| format!("{}.{}", file.package(), message.name()) == name)
    };
    let file = DESCRIPTORS.file.iter().find(defines).expect("a message of this crate");
    let mut set = FileDescriptorSet::default();
    add_with_imports(file, &mut set);
    set.encode_to_vec()
}

fn add_with_imports(file: &FileDescriptorProto, set: &mut FileDescriptorSet) {
    for import in &file.dependency {
        let imported = DESCRIPTORS.file.iter().find(|file| file.name() == import);
        add_with_imports(imported.expect("the set is complete"), set);
    }
    if !set.file.iter().any(|known| known.name() == file.name()) {
        set.file.push(file.clone());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn descriptor_sets_are_complete() {
        for (name, files) in [("percuss.Drag", 1), ("foxglove.Log", 2)] {
            let bytes = descriptor_set(name);
            let set = FileDescriptorSet::decode(bytes.as_slice()).expect("a descriptor set");
            assert_eq!(set.file.len(), files, "{name}");
            assert!(set.file.iter().any(|file| file.source_code_info.is_some()), "comments travel along");
        }
    }
}
