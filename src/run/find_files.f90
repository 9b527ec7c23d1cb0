! SPDX-License-Identifier: MIT
!> Find the files of a run: those of the command line, of a folder, and those that a labelled file names.
module rockdda_run_find_files
   use rockdda_base_error, only : error_type, error_code, make_error
   use rockdda_base_diagnostics, only : diagnostics_type, origin_type, severity
   use rockdda_io_checkpoint, only : checkpoint_path
   use rockdda_io_namelist_file, only : given_group_type, list_given_options
   use rockdda_io_namelist_parser, only : beside
   use rockdda_io_posix, only : get_path_kind, path_kind
   use rockdda_io_recognise, only : recognise, file_kind, kind_name, ddaml_advice, find_model_files
   use rockdda_io_source, only : file_text_problem
   use rockdda_run_input, only : model_input_type
   implicit none
   private
   public :: find_files, find_named_files, recognise_file, with_article, holds_groups, no_groups

   !> The problem of a file without groups that is no options file beside the files of a model.
   character(len=*), parameter :: no_groups = 'the file holds no groups: a model has &model, which names its '// &
      'geometry; a file of options is checked together with the geometry and the analysis file of its model'

contains

   !> Find the files of a run: a folder or a labelled file (then without an analysis file), or a geometry or block file
   !> and an analysis file. The files that a labelled file names are found when it is read.
   subroutine find_files(model, analysis, config, input, messages, error)
      character(len=*), intent(in) :: model     !! a file or a folder
      character(len=*), intent(in) :: analysis  !! '' for a folder or a labelled file
      character(len=*), intent(in) :: config    !! options file, '' for none or that of the folder
      type(model_input_type), intent(inout) :: input
      type(diagnostics_type), intent(inout) :: messages
      type(error_type), allocatable, intent(out) :: error
      integer :: kinds(2)
      logical :: ok(2)
      input%config_file = config
      if (len(analysis) == 0) then
         if (get_path_kind(model) == path_kind%directory) then
            call find_in_folder(model, input, messages, error)
            return
         end if
      end if
      call recognise_file(model, kinds(1), messages, ok(1))
      if (len(analysis) == 0) then
         if (ok(1) .and. kinds(1) == file_kind%labelled) then
            call take_labelled(model, input, error)
         else if (ok(1)) then
            call wrong_kind(model, kinds(1), 'a labelled file (.nml with &model), or a folder, or a geometry or '// &
                            'block file and an analysis file')
         end if
         return
      end if
      call recognise_file(analysis, kinds(2), messages, ok(2))
      if (.not. all(ok)) return
      input%model_file = model
      input%analysis_file = analysis
      input%model_kind = kinds(1)
      if (is_model(kinds(2)) .and. kinds(1) == file_kind%analysis) then
         call wrong_kind(model, kinds(1), 'a geometry or block file; the two files are in the wrong order')
      else
         if (.not. is_model(kinds(1))) call wrong_kind(model, kinds(1), 'a geometry or block file')
         if (kinds(2) /= file_kind%analysis) call wrong_kind(analysis, kinds(2), 'an analysis file')
      end if

   contains

      !> Report a file of the wrong kind.
      subroutine wrong_kind(path, kind, expected)
         character(len=*), intent(in) :: path, expected
         integer, intent(in) :: kind               !! found
         type(origin_type) :: origin
         origin%file = path
         if (kind == file_kind%ddaml) then
            call messages%add(severity%error, ddaml_advice, origin)
         else if (kind == file_kind%options .and. .not. holds_groups(path)) then
            call messages%add(severity%error, no_groups, origin)
         else
            call messages%add(severity%error, 'expected '//expected//', found '//with_article(kind_name(kind))// &
                              to_continue(path, kind), origin)
         end if
      end subroutine wrong_kind

   end subroutine find_files

   !> Does a file of options hold any group?
   logical function holds_groups(path)
      character(len=*), intent(in) :: path
      type(given_group_type), allocatable :: groups(:)
      call list_given_options(path, groups)
      holds_groups = size(groups) > 0
   end function holds_groups

   !> How a run with these results, or this checkpoint, is continued; '' for other files and without a checkpoint.
   function to_continue(path, kind) result(text)
      character(len=*), intent(in) :: path
      integer, intent(in) :: kind                  !! of the file
      character(len=:), allocatable :: text, checkpoint
      text = ''
      checkpoint = path
      if (kind == file_kind%hdf5) then
         checkpoint = checkpoint_path(path)
         text = ", such as the results of a run ('rockdda info' describes it, 'rockdda-post' draws results)"
         if (get_path_kind(checkpoint) /= path_kind%file) return
      else if (kind /= file_kind%checkpoint) then
         return
      end if
      text = text//"; 'rockdda resume "//checkpoint//"' continues its run"
   end function to_continue

   !> Find the files of a folder; an options file of the command line overrides that of the folder.
   subroutine find_in_folder(folder, input, messages, error)
      character(len=*), intent(in) :: folder
      type(model_input_type), intent(inout) :: input
      type(diagnostics_type), intent(inout) :: messages
      type(error_type), allocatable, intent(out) :: error
      character(len=:), allocatable :: config, unread
      call find_model_files(folder, input%model_file, input%analysis_file, config, unread, error)
      if (allocated(error)) return
      if (len(input%model_file) == 0) then
         if (len(unread) > 0) call messages%add(severity%warning, unread//' in the folder '//folder// &
            ' is not read: '//config//' with &model is the whole model')
         call take_labelled(config, input, error)
         return
      end if
      if (allocated(config) .and. len(input%config_file) == 0) input%config_file = config
      call recognise(input%model_file, input%model_kind, error)
   end subroutine find_in_folder

   !> Take a labelled file, which takes no options file beside it.
   subroutine take_labelled(path, input, error)
      character(len=*), intent(in) :: path
      type(model_input_type), intent(inout) :: input
      type(error_type), allocatable, intent(out) :: error
      if (len(input%config_file) > 0) then
         call make_error(error, error_code%input, path//': error: a labelled file holds all options; leave out '// &
                         '--config '//input%config_file)
         return
      end if
      input%labelled = .true.
      input%config_file = path
      input%model_file = ''
      input%analysis_file = ''
   end subroutine take_labelled

   !> Find the files that a labelled file names, beside it.
   subroutine find_named_files(input, messages, ok)
      type(model_input_type), intent(inout) :: input
      type(diagnostics_type), intent(inout) :: messages
      logical, intent(out) :: ok                 !! there is a model to be read
      integer :: kind
      logical :: found
      ok = .false.
      if (.not. input%options%labelled) then
         call messages%add(severity%error, 'there is no group &model, which names the geometry', whole_file())
         return
      else if (.not. input%labelled) then
         call messages%add(severity%error, 'a file with &model is a whole model: run it by itself', &
                           input%options%model_origin)
         return
      end if
      if (input%in_memory) then
         ok = .true.
         return
      end if
      if (allocated(input%options%analysis)) then
         if (len_trim(input%options%analysis) > 0) then
            input%analysis_file = beside(input%config_file, trim(adjustl(input%options%analysis)))
            call recognise_named('analysis', input%analysis_file, input%options%analysis_origin, kind, found)
            if (found .and. kind /= file_kind%analysis) call messages%add(severity%error, input%analysis_file// &
               ': expected an analysis file, found '//with_article(kind_name(kind)), input%options%analysis_origin)
            if (kind /= file_kind%analysis) input%analysis_file = ''
         end if
      end if
      if (.not. allocated(input%options%geometry)) return   ! reported by the reader
      if (len_trim(input%options%geometry) == 0) return
      input%model_file = beside(input%config_file, trim(adjustl(input%options%geometry)))
      call recognise_named('geometry', input%model_file, input%options%geometry_origin, input%model_kind, found)
      if (found .and. .not. is_model(input%model_kind)) call messages%add(severity%error, input%model_file// &
         ': expected a geometry or block file, found '//with_article(kind_name(input%model_kind)), &
         input%options%geometry_origin)
      ok = found .and. is_model(input%model_kind)

   contains

      !> Find the kind of a file that an option names; one that cannot be read is reported there.
      subroutine recognise_named(name, path, origin, kind, found)
         character(len=*), intent(in) :: name           !! of the option
         character(len=*), intent(in) :: path
         type(origin_type), intent(in) :: origin
         integer, intent(out) :: kind                   !! one of file_kind%...
         logical, intent(out) :: found
         character(len=:), allocatable :: problem
         kind = file_kind%unknown
         found = .false.
         problem = file_text_problem(path, any_size=.true.)
         if (len(problem) > 0) then
            call messages%add(severity%error, name//': '//path//': '//problem, origin)
         else
            call recognise_file(path, kind, messages, found)
         end if
      end subroutine recognise_named

      !> The options file as a whole.
      function whole_file() result(origin)
         type(origin_type) :: origin
         origin%file = input%config_file
      end function whole_file

   end subroutine find_named_files

   !> Find the kind of a file; a problem becomes a message and ok is false.
   subroutine recognise_file(path, kind, messages, ok)
      character(len=*), intent(in) :: path
      integer, intent(out) :: kind                 !! one of file_kind%...
      type(diagnostics_type), intent(inout) :: messages
      logical, intent(out) :: ok
      type(error_type), allocatable :: error
      call recognise(path, kind, error)
      ok = .not. allocated(error)
      if (.not. ok) call messages%add_error(error)
   end subroutine recognise_file

   !> Can this kind of file be the model of a run?
   pure logical function is_model(kind)
      integer, intent(in) :: kind
      is_model = kind == file_kind%geometry .or. kind == file_kind%blocks
   end function is_model

   !> "an options file", "a block file"
   pure function with_article(noun) result(text)
      character(len=*), intent(in) :: noun
      character(len=:), allocatable :: text
      text = 'a '//noun
      if (scan(noun(1:1), 'aeiouH') > 0) text = 'an '//noun
   end function with_article

end module rockdda_run_find_files
